// Runs that are long for the numbers that they check. Under the sanitizers, which take ten times as long and look for other faults, a shorter one goes
// through the same code; the numbers are those of the optimised build, which runs them whole.
#ifndef SELDINGER_TESTS_SHORT_RUN_H
#define SELDINGER_TESTS_SHORT_RUN_H

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define WHOLE_RUN 0
#else
#define WHOLE_RUN 1
#endif
// So many steps, rounds or cases.
#define WHOLE_OR_SHORT(whole, shorter) (WHOLE_RUN ? (whole) : (shorter))

// Skips a test of numbers alone, whose code others go through; for cmocka's tests.
#define NEED_WHOLE_RUNS()                                                                                                                                      \
    do {                                                                                                                                                       \
        if (!WHOLE_RUN) {                                                                                                                                      \
            print_message("skipped: a sanitizer is watching\n");                                                                                               \
            skip();                                                                                                                                            \
        }                                                                                                                                                      \
    } while (0)

#endif
