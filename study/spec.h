// What a sweep runs: docs/sweeps.md describes the file. Lengths of time in s, as in scenes.
#ifndef SELDINGER_STUDY_SPEC_H
#define SELDINGER_STUDY_SPEC_H

#include "base/base.h"
#include "study/distribution.h"
#include "study/sobol.h"

#include <stdint.h>

enum { STUDY_FACTORS = SOBOL_DIMENSIONS, STUDY_PATH = 96, STUDY_SCENES = 1000, STUDY_VALUES = 1000, STUDY_FIGURES = 64 };
#define STUDY_RUNS_MOST INT64_C(10000000)    // memory grows by 8 bytes a run when the table is written

typedef enum { SAMPLE_GRID, SAMPLE_RANDOM, SAMPLE_SOBOL } SamplingKind;
typedef enum { RECORD_NONE, RECORD_FAILURES, RECORD_ALL } RecordKind;

typedef struct Factor {
    char path[STUDY_PATH];   // as in the file: "wire.sections[0].young_modulus_gpa"; "scene": its values are scenes
    Distribution values;
    int line, column;        // of its values in the file, for messages
} Factor;

typedef struct RandomHands { // each tool's push and twist keep a speed for a while, then change
    bool wanted;
    int count;               // different hands; 0: another for each run, in a grid one for all
    uint32_t seed;           // run K has the seed `seed` + K % count
    double duration_s;
    double push_least, push_most;    // [mm/s]
    double twist_least, twist_most;  // [deg/s]
    double hold_least, hold_most;    // [s]
} RandomHands;

typedef struct Study {
    char *path, *text;       // of the specification
    size_t length;
    char *scene;             // resolved against its folder; NULL if factor 0 is "scene"
    int scene_line, scene_column, runs_line, runs_column;      // places in the file, for messages
    int factor_count;        // "scene" first, then those of `vary:` in their order
    Factor factor[STUDY_FACTORS];
    RandomHands hands;
    SamplingKind sampling;
    uint32_t seed;           // of SAMPLE_RANDOM, and of the shift of SAMPLE_SOBOL
    double runs;             // a whole number, exact up to 2^53; may exceed STUDY_RUNS_MOST
    double duration_s, settle_s;     // < 0: the script's; none
    bool keeps_score, keeps_golden;
    RecordKind record;
    int figure_count;        // 0: all
    char *figure[STUDY_FIGURES];
} Study;

// `text` need not be NUL-terminated. Reads no other file. NULL with faults.
Study *study_parse(const char *text, size_t length, const char *path, Faults *faults);
Study *study_load(const char *path, Faults *faults);
void study_free(Study *study);       // NULL is allowed

#endif
