// Some runs are long because of the figures that they check. Under the sanitizers, which are ten times slower and detect other faults, a shorter run covers the
// same code; the optimised build makes the whole run and checks the figures.
#ifndef SELDINGER_TESTS_SHORT_RUN_H
#define SELDINGER_TESTS_SHORT_RUN_H

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define WHOLE_RUN 0
#else
#define WHOLE_RUN 1
#endif
// The number of steps, rounds or cases.
#define WHOLE_OR_SHORT(whole, shorter) (WHOLE_RUN ? (whole) : (shorter))

// Skips a cmocka test that checks only figures, if other tests cover its code.
#define NEED_WHOLE_RUNS()                                                                                                                                      \
    do {                                                                                                                                                       \
        if (!WHOLE_RUN) {                                                                                                                                      \
            print_message("skipped: a sanitizer is watching\n");                                                                                               \
            skip();                                                                                                                                            \
        }                                                                                                                                                      \
    } while (0)

#endif
