# Build a package of ROS with the wheels in VENV: cmake_make SOURCE PREFIX BUILD [CMAKE OPTION...] -- TARGET...
#
# Environment: VENV, J = number of parallel compilers (2).
cmake_make() {
  local source=$1 prefix=$2 folder=$3 options=(); shift 3
  while [ "$1" != -- ]; do options+=("$1"); shift; done
  shift
  mkdir -p "$folder"
  (cd "$folder" &&
    cmake "$source" -DCMAKE_INSTALL_PREFIX="$prefix" -DBUILD_TESTING=OFF -DCMAKE_BUILD_TYPE=None \
      -DCMAKE_CXX_FLAGS="-O1 -w -isystem /usr/include/eigen3" \
      -DCMAKE_EXE_LINKER_FLAGS="-Wl,--unresolved-symbols=ignore-in-shared-libs" \
      -DPython3_EXECUTABLE="$VENV/bin/python" -DPYTHON_EXECUTABLE="$VENV/bin/python" "${options[@]}" > cmake.log 2>&1 &&
    make -j"${J:-2}" "$@" > make.log 2>&1) || { echo "$(basename "$source") failed, see $folder/*.log" >&2; exit 1; }
}
