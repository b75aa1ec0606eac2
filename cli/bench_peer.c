#include "cli/bench.h"
int bench_peer(int argc, char **argv) { (void)argc; (void)argv; return EXIT_BAD_INPUT; }
