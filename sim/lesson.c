#include "sim/lesson.h"

#include <stdlib.h>
#include <string.h>

// Contrast goes on in longer steps than the tool: what is seen of it changes slowly.
enum { CONTRAST_EVERY = 10 };

struct Lesson {
    Score *score;
    Contrast *contrast;
    double dt_s, injected;       // [ml] since the last advance
    int64_t steps;
};

Lesson *lesson_create(Simulator *simulator, const VesselTree *tree)
{
    Lesson *lesson = calloc(1, sizeof *lesson);
    if (!lesson)
        return NULL;
    lesson->dt_s = simulator_scene(simulator)->dt / 1000;
    lesson->score = score_create(simulator, tree);
    lesson->contrast = contrast_create(tree, NULL);
    if (lesson->score && lesson->contrast)
        return lesson;
    lesson_free(lesson);
    return NULL;
}

void lesson_free(Lesson *lesson)
{
    if (!lesson)
        return;
    score_free(lesson->score);
    contrast_free(lesson->contrast);
    free(lesson);
}

void lesson_step(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    Lesson *lesson = context;
    score_step(lesson->score, simulator, commands, xray);
    lesson->injected += xray ? (double)xray->contrast_ml_s * lesson->dt_s : 0;
    if (++lesson->steps % CONTRAST_EVERY != 0)
        return;
    double passed = CONTRAST_EVERY * lesson->dt_s;
    contrast_advance(lesson->contrast, passed, score_figures(lesson->score).tip_node, lesson->injected / passed);
    lesson->injected = 0;
}

void lesson_publish(void *context, void *out)
{
    const Lesson *lesson = context;
    LessonView *view = out;
    view->score = score_figures(lesson->score);
    view->injected_ml = contrast_injected_ml(lesson->contrast);
    view->node_count = contrast_node_count(lesson->contrast);
    if (view->node_count > 0)
        memcpy(view->concentration, contrast_concentration(lesson->contrast), (size_t)view->node_count * sizeof *view->concentration);
}

size_t lesson_view_bytes(const Lesson *lesson)
{
    return sizeof(LessonView) + (size_t)contrast_node_count(lesson->contrast) * sizeof(float);
}

const Score *lesson_score(const Lesson *lesson) { return lesson->score; }
