// seldinger-bench: the benchmarks. `seldinger bench` calls it.
#include "bench/bench.h"

#include "base/process.h"

int main(int argc, char **argv) { return process_run(argc, argv, bench_call); }
