# Shared by the scripts of this folder: packages, build. Source it from the repository's root.

packages=(
    g++ cmake ninja-build ccache pkg-config python3
    libvulkan-dev mesa-vulkan-drivers vulkan-validationlayers glslang-tools spirv-tools
    libglm-dev libembree-dev libtbb-dev libzstd-dev libxxhash-dev
    libtinygltf-dev nlohmann-json3-dev libstb-dev libopenexr-dev libcli11-dev libfmt-dev
    libtet1.5-dev libmeshoptimizer-dev libsdl2-dev libimgui-dev
    libgtest-dev libgmock-dev  # CMake looks for all that its targets need, whichever is built
)
bench_packages=(libbenchmark-dev)
test_packages=(clang-format "${bench_packages[@]}")
bench_programs=(dimmer_bench dimmer_update_bench dimmer_pack_bench)  # of bench/

# Installs what is missing of the given Debian packages; says what; does nothing when all is there.
install_packages() {
    local missing=() package
    for package in "$@"; do
        [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return 0
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { echo "Please install as root: ${missing[*]}" >&2; return 1; }
        as_root=(sudo)
    fi
    echo "Installing Debian packages: ${missing[*]}"
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# build PRESET TARGET...: configures when needed and builds. The release preset puts its tools in build/bin/.
build() {
    local preset=$1
    shift
    cmake --preset "$preset" >/dev/null
    cmake --build "build/$preset" --target "$@"
}
