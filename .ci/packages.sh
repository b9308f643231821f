#!/usr/bin/env bash
# .ci/packages.sh PROGRAM PYTHON FOLDER [ROOT]: what is packed of the static PROGRAM (packaging/program).
#
# The tarball, unpacked and run from another folder; the Debian package, installed in ROOT, a bare Debian, or in one that is
# made here (as root); the container file and the conda recipe, which are linted and not built. PYTHON has
# .ci/requirements.txt.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
python=$(realpath -s "$2")
folder=$(realpath -m "$3")
root=${4-$folder/root}
rm -rf "$folder"
mkdir -p "$folder"

if readelf --sections --wide "$program" | grep -q '\.symtab'; then
  echo "$program is not stripped" >&2
  exit 1
fi

tarball=$(packaging/tarball "$program")
echo "tarball: $tarball, $(stat -c %s "$tarball") bytes"
for file in bin/stickslip share/man/man1/stickslip-run.1 share/bash-completion/completions/stickslip \
  share/zsh/site-functions/_stickslip share/fish/vendor_completions.d/stickslip.fish \
  share/doc/stickslip/{LICENSE,THIRD-PARTY.txt,README.md}; do
  [[ $(tar -tzf "$tarball") == *"/$file"* ]] || { echo "the tarball lacks $file" >&2; exit 1; }
done

package=$(packaging/deb "$program")
echo "Debian package: $package, $(stat -c %s "$package") bytes"
if [[ $(id -u) != 0 ]]; then
  echo "Debian package: not installed: not root"
else
  if [[ ! -d $root ]]; then
    # shellcheck source=/dev/null
    suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
    # shellcheck disable=SC2016 # $(SITE) is for apt-get
    mirror=$(apt-get indextargets --format '$(SITE)' | head -n 1)
    debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$folder/debootstrap.log" 2>&1 ||
      { tail -n 20 "$folder/debootstrap.log" >&2; exit 1; }
  fi
  # The program reads files in a process of its own, and finds itself by /proc.
  mount -t proc proc "$root/proc"
  trap 'umount "$root/proc"' EXIT
  cp "$package" "$root/tmp/stickslip.deb"
  cat >"$root/tmp/check" <<'EOF'
set -euo pipefail
dpkg -i /tmp/stickslip.deb >/dev/null
cd /tmp
stickslip --version
stickslip run --quiet
stickslip check paper.h5
test -s /usr/share/man/man1/stickslip-run.1.gz
source /usr/share/bash-completion/completions/stickslip
complete -p stickslip
dpkg -r stickslip >/dev/null
test ! -e /usr/bin/stickslip
EOF
  env -i HOME=/tmp LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin chroot "$root" bash /tmp/check
fi

"$(dirname "$python")/hadolint" packaging/Containerfile
echo "container file: linted, not built"
"$python" - <<'EOF'
import tomllib
import yaml

with open("Cargo.toml", "rb") as file:
    version = tomllib.load(file)["workspace"]["package"]["version"]
with open("packaging/conda/recipe.yaml") as file:
    recipe = yaml.safe_load(file)
assert recipe["context"]["version"] == version, recipe["context"]
assert all(isinstance(line, str) for line in recipe["build"]["script"]["content"]), recipe["build"]
assert recipe["tests"] and recipe["about"]["license"] == "MIT OR Apache-2.0"
EOF
echo "conda recipe: linted, not built"
