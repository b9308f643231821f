#!/usr/bin/env bash
# .ci/foreign.sh PROGRAM FOLDER: the solvers in MATLAB's language (by Octave) and in Julia (where it is installed) run, and
# agree with the reference.
set -euo pipefail
program=$(realpath "$1")
examples=$(realpath "$(dirname "$0")/../examples/validate")
mkdir -p "$2"
cd "$2"
"$program" run paper-si --quiet --force
"$program" export paper-si.h5 --table events -o events.mat --quiet --force
"$program" export paper-si.h5 --table events -o events.csv --quiet --force
# Octave without a window complains at its end.
octave --no-gui --quiet --path "$examples" --eval "brake('events.mat', 'octave.csv')" 2>octave.log ||
  { cat octave.log >&2; exit 1; }
"$program" compare paper-si.h5 octave.csv --require 'events<1e-9' --require 'missing<1' --require 'spurious<1' | head -n 2
if command -v julia >/dev/null; then
  julia "$examples/brake.jl" events.csv julia.csv
  "$program" compare paper-si.h5 julia.csv --require 'events<1e-9' --require 'missing<1' --require 'spurious<1' | head -n 2
else
  echo "Julia: skipped: not installed"
fi
