#!/usr/bin/env bash
# .ci/systems.sh PYTHON FOLDER SUITE...: the packages of target/packages on bare systems of other versions: Debian (bullseye,
# bookworm, trixie) and Ubuntu (jammy, noble). Before a release; as root, because of chroot.
#
# In each SUITE, made in FOLDER by debootstrap: the Debian package is installed, run and removed; the tarball is unpacked and run; the
# wheel is installed by pip, with NumPy alone, and computes and opens a run. PYTHON fetches NumPy for its Python.
# MIRROR_DEBIAN (by default the one of this system) and MIRROR_UBUNTU name the mirrors.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$(realpath -s "$1")
folder=$(realpath -m "$2")
shift 2
packages=$PWD/target/packages
mkdir -p "$folder"

make_root() {
  local suite=$1 root=$2
  local options=(--variant=minbase "--include=python3,python3-venv")
  case $suite in
    jammy | noble)
      # Debian has no key of Ubuntu; the mirror is named by https.
      options+=(--no-check-gpg "--components=main,universe")
      debootstrap "${options[@]}" "$suite" "$root" "${MIRROR_UBUNTU:?}" gutsy
      ;;
    *)
      # shellcheck disable=SC2016 # $(SITE) is for apt-get
      debootstrap "${options[@]}" "$suite" "$root" \
        "${MIRROR_DEBIAN-$(apt-get indextargets --format '$(SITE)' | head -n 1)}"
      ;;
  esac
}

cat >"$folder/check" <<'EOF'
set -euo pipefail
for tool in gcc cargo cmake h5dump; do
  ! command -v "$tool" || { echo "this system is not bare: it has $tool" >&2; exit 1; }
done
. /etc/os-release
echo "$PRETTY_NAME, $(ldd --version | head -n 1), $(python3 --version)"
work=$(mktemp -d)
cd "$work"
dpkg -i /packages/stickslip_*.deb >/dev/null
stickslip --version
stickslip run --quiet -o deb.h5
stickslip check deb.h5
stickslip plot deb.h5 >/dev/null
dpkg -r stickslip >/dev/null
test ! -e /usr/bin/stickslip
echo "Debian package: runs"
tar -xzf /packages/stickslip-*.tar.gz
./stickslip-*/bin/stickslip run --quiet -o tarball.h5
./stickslip-*/bin/stickslip check tarball.h5
echo "tarball: runs"
python3 -m venv environment
environment/bin/pip install --quiet --disable-pip-version-check --no-index --find-links /packages stickslip
environment/bin/stickslip run --quiet -o wheel.h5
environment/bin/python - <<'PYTHON'
import stickslip

run = stickslip.run("paper")
assert run.summary["stick_count"] == 48, run.summary
assert len(stickslip.open("deb.h5").events) == len(run.events) == 100
PYTHON
echo "wheel: runs, module and program"
EOF

for suite in "$@"; do
  root=$folder/$suite
  if [[ ! -e $root/.made ]]; then
    rm -rf "$root"
    make_root "$suite" "$root" >"$folder/$suite.log" 2>&1 || { tail -n 20 "$folder/$suite.log" >&2; exit 1; }
    touch "$root/.made"
  fi
  version=$(chroot "$root" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  rm -rf "$root/packages"
  mkdir "$root/packages"
  cp "$packages"/stickslip* "$folder/check" "$root/packages/"
  "$python" -m pip download --quiet --disable-pip-version-check --only-binary=:all: --python-version "$version" \
    --dest "$root/packages" numpy
  mount -t proc proc "$root/proc"
  trap 'umount "$root/proc"' EXIT
  env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin chroot "$root" bash /packages/check
  umount "$root/proc"
  trap - EXIT
done
