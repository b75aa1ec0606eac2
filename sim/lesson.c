#include "sim/lesson.h"

#include <stdlib.h>
#include <string.h>

// Contrast advances in longer steps than the tool, because its image changes slowly.
enum { CONTRAST_EVERY = 10 };

struct Lesson {
    Score *score;
    ContrastInjection *injection;
    int tool_count;
    double dt_s, injected;       // [ml] since the last advance
    double flow;                 // [ml/s] in the last step
    XrayControl xray;            // of the last step
    int64_t steps;
};

static ContrastInjection *create_injection(const Simulator *simulator, const Stepper *stepper, const VesselTree *tree)
{
    int count = stepper_tool_count(stepper), node_count[TOOLS_MOST] = {0};
    double *s[TOOLS_MOST] = {NULL};
    bool good = true;
    for (int k = 0; good && k < count; k++) {
        node_count[k] = stepper_tool_nodes(stepper, k, NULL);
        ToolNode *node = malloc((size_t)node_count[k] * sizeof *node);
        s[k] = malloc((size_t)node_count[k] * sizeof *s[k]);
        good = node && s[k];
        if (good)
            stepper_tool_nodes(stepper, k, node);
        for (int j = 0; good && j < node_count[k]; j++)
            s[k][j] = node[j].s;
        free(node);
    }
    ContrastInjection *injection = good ? contrast_injection_create(tree, simulator_scene(simulator), node_count, (const double *const *)s) : NULL;
    for (int k = 0; k < count; k++)
        free(s[k]);
    return injection;
}

Lesson *lesson_create(Simulator *simulator, const VesselTree *tree)
{
    Lesson *lesson = calloc(1, sizeof *lesson);
    if (!lesson)
        return NULL;
    const Stepper *stepper = simulator_stepper(simulator);
    lesson->tool_count = stepper_tool_count(stepper);
    lesson->dt_s = simulator_scene(simulator)->dt / 1000;
    lesson->score = score_create(simulator, tree);
    lesson->injection = create_injection(simulator, stepper, tree);
    if (lesson->score && lesson->injection)
        return lesson;
    lesson_free(lesson);
    return NULL;
}

void lesson_free(Lesson *lesson)
{
    if (!lesson)
        return;
    score_free(lesson->score);
    contrast_injection_free(lesson->injection);
    free(lesson);
}

static TipPlaces find_tips(const Lesson *lesson, const Stepper *stepper)
{
    const ScoreFigures figures = score_figures(lesson->score);
    TipPlaces places = {.foremost_node = figures.tip_node};
    for (int k = 0; k < lesson->tool_count; k++) {
        places.inserted[k] = stepper_tool_inserted(stepper, k);
        places.node[k] = figures.tool[k].tip_node;
    }
    return places;
}

void lesson_step(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    Lesson *lesson = context;
    const Stepper *stepper = simulator_stepper(simulator);
    int fitted[TOOLS_MOST] = {0};
    for (int k = 0; k < lesson->tool_count; k++)
        fitted[k] = stepper_fitted(stepper, k);
    contrast_injection_fit(lesson->injection, fitted);
    XrayControl flowing = xray ? *xray : (XrayControl){0};   // agent that the lumen does not pass is not counted as used
    if (flowing.contrast_ml_s > 0) {
        double inserted[TOOLS_MOST] = {0};
        for (int k = 0; k < lesson->tool_count; k++)
            inserted[k] = stepper_tool_inserted(stepper, k);
        flowing.contrast_ml_s = (float)contrast_injection_flow(lesson->injection, xray, inserted);
    }
    lesson->flow = (double)flowing.contrast_ml_s;
    lesson->xray = flowing;
    score_step(lesson->score, simulator, commands, xray ? &flowing : NULL);
    lesson->injected += lesson->flow * lesson->dt_s;
    if (++lesson->steps % CONTRAST_EVERY != 0)
        return;
    TipPlaces places = find_tips(lesson, stepper);
    contrast_injection_advance(lesson->injection, CONTRAST_EVERY * lesson->dt_s, &flowing, lesson->injected, &places);
    lesson->injected = 0;
}

void lesson_publish(void *context, void *out)
{
    const Lesson *lesson = context;
    LessonView *view = out;
    view->score = score_figures(lesson->score);
    view->injected_ml = contrast_injection_injected_ml(lesson->injection);
    view->flow_ml_s = lesson->flow;
    view->contrast_tool = contrast_injection_tool(lesson->injection, &lesson->xray);
    view->node_count = contrast_injection_tree_nodes(lesson->injection);
    view->filling_count = contrast_injection_node_count(lesson->injection) - view->node_count;
    contrast_injection_read(lesson->injection, view->concentration);
}

size_t lesson_view_bytes(const Lesson *lesson) { return sizeof(LessonView) + (size_t)contrast_injection_node_count(lesson->injection) * sizeof(float); }

const Score *lesson_score(const Lesson *lesson) { return lesson->score; }
