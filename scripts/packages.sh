# shellcheck shell=bash
# For check and quickstart: say, fail, install_packages. Sourced by bash.

say() { printf '\n== %s\n' "$*"; }
fail() {
  printf '\n%s: error: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}
trap 'fail "line $LINENO failed: $BASH_COMMAND"' ERR

# What gart is built and tested with, by the names of Debian 12 and Ubuntu 24.04.
packages=(cmake ninja-build g++ pkg-config git python3 libembree-dev libglm-dev libpng-dev libturbojpeg0-dev
  libzstd-dev libwebp-dev nlohmann-json3-dev libcli11-dev libeigen3-dev doctest-dev libbenchmark-dev libopenmpi-dev openmpi-bin
  libopenvdb-dev libboost-dev python3-dev python3-numpy pybind11-dev)

is_installed() { [[ $(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]; }

missing_packages() {
  local package
  for package in "${packages[@]}"; do
    is_installed "$package" || printf '%s ' "$package"
  done
}

install_packages() {
  command -v apt-get >/dev/null ||
    fail "no apt-get here. Install what these Debian packages hold, then follow docs/getting_started.md: ${packages[*]}"
  local missing root=()
  missing=$(missing_packages)
  if [[ -z $missing ]]; then
    say "packages: all there"
    return
  fi
  if [[ $(id -u) != 0 ]]; then
    command -v sudo >/dev/null || fail "packages are missing, and there is neither root nor sudo. As root, run: apt-get install $missing"
    root=(sudo)
  fi
  say "packages: installing $missing"
  "${root[@]}" apt-get update -q || fail "apt-get update failed: see above"
  # shellcheck disable=SC2086  # one word a package
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing ||
    fail "apt-get could not install $missing: see above"
}

# A command or a package that a test is skipped without, and its package where that has another name. What apt knows of its packages may
# be missing or old: it is asked again where it cannot.
wish_for() {
  local command=$1 package=${2:-$1} root=() install
  if command -v "$command" >/dev/null || is_installed "$package"; then return; fi
  say "packages: installing $package"
  [[ $(id -u) == 0 ]] || root=(sudo)
  install=("${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "$package")
  "${install[@]}" || { "${root[@]}" apt-get update -q && "${install[@]}"; } ||
    say "no $command here: what needs it is skipped"
}

# The options that both builds share; the compiler cache where there is one.
configure() {
  local folder=$1 launcher=()
  shift
  if command -v ccache >/dev/null; then
    launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_CUDA_COMPILER_LAUNCHER=ccache)
  fi
  cmake --no-warn-unused-cli -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release "${launcher[@]}" "$@"
}
