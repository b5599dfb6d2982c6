#!/bin/bash
# Makes this machine ready: system packages, then .venv with pinned Python packages and the command `bslam`.
#
#   tools/setup.sh run     what `make run` needs: Python, a C compiler
#   tools/setup.sh test    that, and what `make test` needs: CMocka, compilers, QEMU, browser, valgrind
#   tools/setup.sh bench   the same, for `make bench`
#   tools/setup.sh proof   that, and what `make proof` needs: libFuzzer and MC/DC of clang
#
# Quick when nothing is missing; asks no question. With NO_INSTALL=1 apt-get's command is printed, not run.
# Exit status 0: ready. 2: something is missing that could not be installed; the first line says what.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."

readonly part=${1:-test}
readonly venv=.venv
readonly python_min=3.11

fail() {
    printf 'setup: %s\n' "$@" >&2
    exit 2
}

# --- Python -------------------------------------------------------------------------------------------------

# The first interpreter on PATH that starts and is new enough; a pyenv shim may be neither.
find_python() {
    local name
    for name in python3 python3.11 python3.12 python3.13 python3.14; do
        if "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' </dev/null >/dev/null 2>&1; then
            command -v "$name"
            return
        fi
    done
    return 1
}

python_can() {
    "$python" -c "$1" </dev/null >/dev/null 2>&1
}

# --- System packages ----------------------------------------------------------------------------------------

packages=() # Debian names of what is missing
reasons=()  # "what it is for", one per package

need() { # PACKAGE REASON COMMAND...: the package is missing unless the command succeeds
    local package=$1 reason=$2
    shift 2
    if ! "$@" </dev/null >/dev/null 2>&1; then
        packages+=("$package")
        reasons+=("$package for $reason")
    fi
}

arm_headers() { # arm-none-eabi-gcc is there and finds a C library
    echo '#include <math.h>' | arm-none-eabi-gcc -E -o /dev/null -
}

has_browser() { # one of those that tests/python/browser/conftest.py looks for
    command -v chromium-headless-shell || command -v chromium || command -v google-chrome
}

find_missing() {
    packages=() reasons=()
    if python=$(find_python); then
        local version
        version=$("$python" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')
        need "$version-venv" "the virtual environment" python_can 'import venv, ensurepip'
        need "$version-dev" "the C extension" python_can \
            'import os, sysconfig; os.stat(os.path.join(sysconfig.get_path("include"), "Python.h"))'
    elif command -v python3 >/dev/null; then
        fail "no Python $python_min or newer on PATH (python3 is $(python3 --version 2>&1 | head -n 1))"
    else
        packages+=(python3 python3-venv python3-dev)
        reasons+=("python3 (with -venv, -dev) for everything")
    fi
    need gcc "the C compiler" command -v "${CC:-cc}"
    need libc6-dev "the C headers" sh -c 'echo "#include <math.h>" | ${CC:-cc} -E -o /dev/null -'
    [[ $part == run ]] && return
    need pkg-config "finding CMocka" command -v pkg-config
    need libcmocka-dev "the C unit tests" sh -c 'echo "#include <stdarg.h>
        #include <stddef.h>
        #include <stdint.h>
        #include <setjmp.h>
        #include <cmocka.h>" | ${CC:-cc} -E -o /dev/null -'
    need gcc-arm-none-eabi "the firmware build" command -v arm-none-eabi-gcc
    need libnewlib-arm-none-eabi "the firmware build" arm_headers
    need cmake "the CMake build" command -v cmake
    need qemu-system-arm "running the firmware" command -v qemu-system-arm
    need chromium-headless-shell "trying the pages in a browser" has_browser
    need valgrind "counting instructions" command -v valgrind
    need g++ "users' programs in C++" command -v g++
    need clang-19 "users' programs by a second compiler, and the playground" command -v clang++-19
    need lld-19 "linking the playground" command -v wasm-ld-19
    [[ $part == test || $part == bench ]] && return
    need llvm-19 "reading coverage" command -v llvm-cov-19
    need libclang-rt-19-dev "fuzzing and coverage" sh -c 'echo "int main(void) { return 0; }" |
        clang-19 -x c -fsanitize=address -fprofile-instr-generate - -o /dev/null'
}

install_missing() {
    find_missing
    [[ ${#packages[@]} -eq 0 ]] && return
    local why root=()
    why=$(printf ', %s' "${reasons[@]}")
    why=${why:2}
    [[ $(id -u) -eq 0 ]] || root=(sudo -n)
    local apt_get_install="apt-get install -y --no-install-recommends"
    local command="${root[*]:+sudo }$apt_get_install ${packages[*]}"

    [[ ${NO_INSTALL:-0} != 1 ]] || fail "missing: $why (NO_INSTALL=1 is set)" "install with: $command"
    command -v apt-get >/dev/null || fail "missing: $why (no apt-get here)" "on Debian: $command"
    [[ ${#root[@]} -eq 0 ]] || sudo -n true 2>/dev/null ||
        fail "missing: $why (not root, and sudo would ask)" "install with: $command"

    echo "setup: installing with apt-get, which may take minutes: $why"
    export DEBIAN_FRONTEND=noninteractive
    # A failed update is no reason to stop: the lists at hand may do, and the check below has the last word.
    local log
    log=$("${root[@]}" apt-get -qq update </dev/null 2>&1) || true
    log+=$("${root[@]}" $apt_get_install -qq "${packages[@]}" </dev/null 2>&1) || true
    find_missing
    [[ ${#packages[@]} -eq 0 ]] ||
        fail "apt-get could not install: ${packages[*]}" "the command was: $command" "it said: $log"
}

# --- The virtual environment --------------------------------------------------------------------------------

pip_install() {
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input "$@" </dev/null ||
        fail "pip could not install into $venv; the command was: $venv/bin/python -m pip install $*"
}

# Runs a step unless its stamp says it was done, here, from the same inputs. Scripts in a venv hold its
# absolute path, so that is part of the fingerprint.
once() { # STAMP INPUT_FILES -- COMMAND...
    local stamp=$venv/$1 inputs=() fingerprint
    shift
    while [[ $1 != -- ]]; do inputs+=("$1") && shift; done
    shift
    fingerprint=$(pwd && cksum "${inputs[@]}")
    [[ -f $stamp && $(<"$stamp") == "$fingerprint" ]] && return
    "$@"
    printf '%s\n' "$fingerprint" >"$stamp"
}

make_venv() {
    # A venv dies with the interpreter it was made from, and is of no use if its making was cut short.
    "$venv/bin/python" -c 'import pip' 2>/dev/null && return
    echo "setup: making $venv with $python"
    "$python" -m venv --clear "$venv" </dev/null || fail "$python could not make $venv"
}

install_run_packages() {
    echo "setup: installing requirements.txt into $venv, which may take minutes"
    pip_install --require-hashes -r requirements.lock.txt
    echo "setup: building the extensions, a minute or two"
    pip_install --no-deps --no-build-isolation --editable .
}

install_test_packages() {
    echo "setup: installing requirements-test.txt into $venv, which may take minutes"
    pip_install --require-hashes -r requirements-test.lock.txt
}

case $part in
    run | test | bench | proof) ;;
    *) fail "unknown part '$part'; allowed: run, test, bench, proof" ;;
esac
install_missing
make_venv
once run.stamp requirements.lock.txt pyproject.toml -- install_run_packages
[[ $part == run ]] || once test.stamp requirements-test.lock.txt -- install_test_packages
