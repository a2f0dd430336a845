#!/usr/bin/env bash
# All tests, as an ordinary user, in an environment of their own. Arguments go to pytest.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/env.sh"
cd "$root"
exec python -m pytest -n "${EPA_TEST_PROCESSES:-3}" --dist loadgroup "$@"
