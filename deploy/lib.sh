# shellcheck shell=bash
# What the scripts in deploy/ have in common. Sourced, from the project's root.

say() { printf '%s\n' "$*"; }

complain() { printf '%s: %s\n' "${0##*/}" "$*" >&2; }

# The packages named in the given list files.
packages_in() { sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$@"; }

is_installed() {
  [[ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" == installed ]]
}

# install_packages LIST...: installs what is missing, and touches nothing if all is there. Says before
# what is installed, and what that upgrades.
install_packages() {
  local package missing=()
  if command -v dpkg-query >/dev/null; then
    while read -r package; do
      is_installed "$package" || missing+=("$package")
    done < <(packages_in "$@")
  else
    complain "not a Debian system, so nothing is installed. Needed: $(packages_in "$@" | xargs)"
    return 0
  fi
  if ((${#missing[@]} == 0)); then
    return 0
  fi
  local as_root=()
  if ((EUID != 0)); then
    if ! command -v sudo >/dev/null; then
      complain "these packages are missing: ${missing[*]}"
      complain "to install them, run apt-get install as root; there is no sudo here"
      return 1
    fi
    as_root=(sudo)
  fi
  say "To be installed, with what they depend on: ${missing[*]}"
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive
             apt-get -q -y -o DPkg::Lock::Timeout=300)
  local upgrades
  if ! "${apt[@]}" update ||
    ! upgrades="$("${apt[@]}" --simulate install --no-install-recommends "${missing[@]}")"; then
    complain "apt-get could not find the packages above"
    return 1
  fi
  # "Inst NAME [VERSION] (NEW ...": the version is there only of what is installed.
  upgrades="$(sed -n 's/^Inst \([^ ]*\) \[\([^]]*\)\] (\([^ ]*\) .*/  \1 \2 -> \3/p' <<<"$upgrades")"
  if [[ -n "$upgrades" ]]; then
    say "They need newer versions of these installed packages, which are upgraded:"
    say "$upgrades"
  fi
  if ! "${apt[@]}" install --no-install-recommends "${missing[@]}"; then
    complain "apt-get could not install the packages above"
    return 1
  fi
  # Tests start their own.
  local service
  for service in etcd-server:etcd mosquitto:mosquitto; do
    if [[ " ${missing[*]} " == *" ${service%:*} "* && -d /run/systemd/system ]]; then
      "${as_root[@]}" systemctl --quiet disable --now "${service#*:}"
    fi
  done
}

# configure PRESET [ARGUMENT...]: cheap when nothing has changed, and quiet unless it fails.
configure() {
  mkdir -p build
  local log="build/configure-$1.log"
  if ! cmake --preset "$@" >"$log" 2>&1; then
    cat "$log" >&2
    return 1
  fi
}

# build PRESET [TARGET...]: configures and builds; all targets unless some are named.
build() {
  local preset="$1"
  shift
  configure "$preset" && cmake --build "build/$preset" --parallel "$(nproc)" ${1+--target "$@"}
}

# What ./deploy/run shows.
build_programs() { build gate pheromoned pheromonectl pheromone-swarm pheromone-robot; }

# debian_base FOLDER: a small Debian 12 in FOLDER, made once; tests boot copies of it. Must be root.
debian_base() {
  [[ ! -f "$1/made" ]] || return 0
  rm -rf -- "$1"
  mkdir -p -- "$1"
  say "Making a Debian tree ..."
  debootstrap --variant=minbase --include=systemd,systemd-sysv,udev,dbus,python3 \
    bookworm "$1" >"$1.log" 2>&1 || { tail -n 20 "$1.log" >&2; return 1; }
  touch "$1/made"
}

# depends_of DEB: the packages that it depends on, without versions, each on a line.
depends_of() {
  dpkg-deb -f "$1" Depends | tr ',' '\n' | sed -e 's/(.*//' -e 's/|.*//' -e 's/[[:space:]]//g'
}
