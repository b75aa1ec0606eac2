// The parts of a score: their names in files and on screens, and why each costs points. sim/score_points.c measures them.
#ifndef SELDINGER_SIM_SCORE_PART_H
#define SELDINGER_SIM_SCORE_PART_H

typedef enum { PART_TIME, PART_FLUOROSCOPY, PART_CONTRAST, PART_PATH, PART_WALL_FORCE, PART_WALL_IMPULSE, PART_BLIND, PART_GUIDANCE, PART_COUNT } ScorePart;

typedef struct ScorePartWords {
    const char *title;           // on screens
    const char *unit;
    const char *why;             // what was done, if the part lost points
} ScorePartWords;

extern const char *const score_part_name[PART_COUNT + 1];      // in files: "time", "fluoroscopy", …; NULL at the end
extern const char *const score_part_par_name[PART_COUNT + 1];  // keys of an exercise's `par:`: "time_s", …; NULL at the end
extern const ScorePartWords score_part_words[PART_COUNT];

#endif
