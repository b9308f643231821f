#!/usr/bin/env bash
# .ci/bare.sh WHEEL PYTHON FOLDER: a bare Debian in FOLDER that has python3 and venv and nothing else of what the program is built
# with; there the wheel is installed, the paper's case is run, its result is opened with xarray, and the tests of the Python
# package pass. PYTHON fetches what else is installed there. As root, because of chroot.
set -euo pipefail
cd "$(dirname "$0")/.."
wheel=$(realpath "$1")
python=$(realpath -s "$2")
folder=$(realpath -m "$3")
root=$folder/root
rm -rf "$folder"
mkdir -p "$folder/wheels"

# shellcheck source=/dev/null
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
# shellcheck disable=SC2016 # $(SITE) is for apt-get
mirror=$(apt-get indextargets --format '$(SITE)' | head -n 1)
debootstrap --variant=minbase --include=python3,python3-venv "$suite" "$root" "$mirror" >"$folder/debootstrap.log" 2>&1 ||
  { tail -n 20 "$folder/debootstrap.log" >&2; exit 1; }
mount -t proc proc "$root/proc"
trap 'umount "$root/proc"' EXIT

# What is installed beside the wheel is fetched out here: the bare system needs no network.
version=$(chroot "$root" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
cp "$wheel" "$folder/wheels/"
"$python" -m pip download --quiet --disable-pip-version-check --only-binary=:all: --python-version "$version" \
  --dest "$folder/wheels" "${wheel}[all,test]"
cp -r "$folder/wheels" "$root/wheels"
mkdir -p "$root/home/package/python"
cp -r docs "$root/home/package/"
cp -r python/tests python/pyproject.toml "$root/home/package/python/"

cat >"$root/home/check" <<'EOF'
set -euo pipefail
cd /home/package/python
for tool in gcc cargo cmake h5dump; do
  ! command -v "$tool" || { echo "this Debian is not bare: it has $tool" >&2; exit 1; }
done
python3 -m venv /venv
PATH=/venv/bin:$PATH
pip install --quiet --disable-pip-version-check --no-index --find-links /wheels stickslip
stickslip --version
stickslip run
python -c 'import stickslip; print(stickslip.run("paper"))'
pip install --quiet --disable-pip-version-check --no-index --find-links /wheels 'stickslip[all,test]'
python - <<'PYTHON'
import xarray

events = xarray.open_dataset("paper.h5", group="events", engine="h5netcdf")
print(events)
assert events.sizes["event"] == 100, events.sizes
PYTHON
pytest -q tests
EOF
env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin chroot "$root" bash /home/check
