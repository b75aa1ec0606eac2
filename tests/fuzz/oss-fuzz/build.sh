#!/bin/bash -eu
# OSS-Fuzz: builds the targets into $OUT, each with its seeds and dictionary. Compiler, flags and engine are given by variables (CC, CXX, CFLAGS, CXXFLAGS,
# LIB_FUZZING_ENGINE). Shared libraries that the machine which runs the targets may lack go to $OUT/lib.
# Without a container, from the project's root:
#   export CC=clang-14 CXX=clang++-14 CFLAGS="-O1 -fsanitize=address,fuzzer-no-link"
#   SRC=/nowhere WORK=/tmp/work OUT=/tmp/out CXXFLAGS=$CFLAGS LIB_FUZZING_ENGINE=-fsanitize=fuzzer tests/fuzz/oss-fuzz/build.sh
source=$SRC/seldinger
[ -d "$source" ] || source=$(cd "$(dirname "$0")/../../.." && pwd)

cmake -G Ninja -S "$source" -B "$WORK/seldinger" -DCMAKE_BUILD_TYPE=None -DSELDINGER_FUZZ=ON -DSELDINGER_FUZZ_ENGINE="$LIB_FUZZING_ENGINE" -DSELDINGER_RENDER=OFF \
    -DSELDINGER_EMBREE=OFF -DCMAKE_BUILD_RPATH='$ORIGIN/lib' -DCMAKE_EXE_LINKER_FLAGS="${LDFLAGS:-} -Wl,--disable-new-dtags"     # for the libraries' libraries too
cmake --build "$WORK/seldinger" --target fuzzers

mkdir -p "$OUT/lib"
for program in "$WORK"/seldinger/bin/fuzz_*; do
    target=${program##*/fuzz_}
    cp "$program" "$OUT/"
    # what is loaded beside libc and the compiler's own
    ldd "$program" | awk '$3 ~ /^\// {print $3}' | grep -Ev '/(ld-linux.*|libc|libm|libdl|librt|libpthread|libgcc_s|libresolv)\.so' | xargs -r cp -n -L -t "$OUT/lib" || true
    (cd "$source/tests/fuzz/corpus/$target" && zip -q -r - .) > "$OUT/fuzz_${target}_seed_corpus.zip"
    dictionary=$source/tests/fuzz/corpus/$target.dict
    [ ! -f "$dictionary" ] || cp "$dictionary" "$OUT/fuzz_$target.dict"
    [ ! -f "${dictionary%.dict}.options" ] || cp "${dictionary%.dict}.options" "$OUT/fuzz_$target.options"
done
