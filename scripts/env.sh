# Makes .venv with the pinned packages of requirements.txt, and compiles what runs and diagnoses need; sourced by demo.sh and test.sh. Runs as an ordinary user.
# What is there and up to date is left alone, so a second call takes no time.

# a run is several processes, and each of them would compile what it imports anew
unset PYTHONDONTWRITEBYTECODE

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=${EPA_VENV:-$root/.venv}

find_python() {
    local candidate
    for candidate in ${EPA_PYTHON:-} python3 python3.13 python3.12 python3.11; do
        if command -v "$candidate" >/dev/null 2>&1 &&
            "$candidate" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null; then
            # of an environment its base: the environment may be made anew here
            "$candidate" -c 'import sys; print(getattr(sys, "_base_executable", sys.executable))'
            return 0
        fi
    done
    echo "found no Python 3.11 to 3.13, expected one: sudo apt install python3 python3-venv" >&2
    return 1
}

# Every package is pinned, so pip has nothing to resolve, and two of them share the work: most of it is
# looking up one package after the other. Bytecode is made of what is imported.
install_both_halves() (
    half() {
        awk "NR % 2 == $2" "$root/requirements.txt" >"$venv/half_$2.txt"
        "$1" -m pip install --quiet --disable-pip-version-check --no-deps --no-compile -r "$venv/half_$2.txt"
    }
    half "$1" 0 &
    half "$1" 1
    second=$?
    wait $! && [ $second = 0 ]
)

make_environment() {
    local python stamp wanted
    python=$(find_python) || return 1
    stamp=$venv/epa-stamp
    wanted=$(cat "$root/requirements.txt" "$root/pyproject.toml" | cksum; "$python" -V; echo "$root")
    if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ]; then
        return 0
    fi
    if [ -n "$(ls -A "$venv" 2>/dev/null)" ] && [ ! -f "$stamp" ]; then
        echo "found $venv, which this script did not make," \
            "expected a free name (EPA_VENV=NAME), or delete it" >&2
        return 1
    fi
    echo "making $venv with pinned packages (once, a minute or two) ..." >&2
    rm -rf "$venv"
    if ! "$python" -m venv "$venv" >/dev/null 2>&1; then
        rm -rf "$venv"
        echo "found a Python without venv, expected one that can make environments: sudo apt install python3-venv" >&2
        return 1
    fi
    echo unfinished >"$stamp"
    install_both_halves "$venv/bin/python" &&
        "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e "$root" &&
        echo "$wanted" >"$stamp" || return 1
    echo "compiling the plant and what a diagnosis asks of it (once, a minute) ..." >&2
    "$venv/bin/python" "$root/scripts/compile_once.py" || echo "not compiled; the first run will do it" >&2
}

make_environment || exit 1
export PATH="$venv/bin:$PATH"
