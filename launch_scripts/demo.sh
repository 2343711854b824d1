#!/usr/bin/env bash
# The demo: `cromosim demo` with its own arguments (--motion FILE.bvh, --out DIR, ...).
set -euo pipefail
cromosim=${CROMOSIM:-cromosim}
exec "$cromosim" demo "$@"
