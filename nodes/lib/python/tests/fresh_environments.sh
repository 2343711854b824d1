#!/usr/bin/env bash
# The tests with a wheel as users get it, in a fresh environment of each Python:
#   nodes/lib/python/tests/fresh_environments.sh WHEEL PYTHON...
# CROMOSIM_BINARY names the command line to compare with.
set -euo pipefail
wheel=$(realpath "$1")
shift
tests=$(cd "$(dirname "$0")" && pwd)
for python in "$@"; do
    environment=$(mktemp -d)
    trap 'rm -rf "$environment"' EXIT
    "$python" -m venv "$environment"
    "$environment/bin/pip" install --quiet --disable-pip-version-check -r "$tests/requirements.txt" "$wheel"
    "$environment/bin/python" --version
    # Away from the sources, so that the wheel is what is imported.
    (cd "$environment" && bin/python -m pytest -q -rs -p no:cacheprovider "$tests")
    rm -rf "$environment"
done
