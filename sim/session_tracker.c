#include "sim/session_tracker.h"

#include <stdlib.h>
#include <string.h>

// Contrast advances in longer steps than the tool, because its image changes slowly.
enum { CONTRAST_EVERY = 10 };

struct SessionTracker {
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

SessionTracker *session_tracker_create(Simulator *simulator, const VesselTree *tree)
{
    SessionTracker *tracker = calloc(1, sizeof *tracker);
    if (!tracker)
        return NULL;
    const Stepper *stepper = simulator_stepper(simulator);
    tracker->tool_count = stepper_tool_count(stepper);
    tracker->dt_s = simulator_scene(simulator)->dt / 1000;
    tracker->score = score_create(simulator, tree);
    tracker->injection = create_injection(simulator, stepper, tree);
    if (tracker->score && tracker->injection)
        return tracker;
    session_tracker_free(tracker);
    return NULL;
}

void session_tracker_free(SessionTracker *tracker)
{
    if (!tracker)
        return;
    score_free(tracker->score);
    contrast_injection_free(tracker->injection);
    free(tracker);
}

static TipPlaces find_tips(const SessionTracker *tracker, const Stepper *stepper)
{
    const ScoreFigures figures = score_figures(tracker->score);
    TipPlaces places = {.foremost_node = figures.tip_node};
    for (int k = 0; k < tracker->tool_count; k++) {
        places.inserted[k] = stepper_tool_inserted(stepper, k);
        places.node[k] = figures.tool[k].tip_node;
    }
    return places;
}

void session_tracker_step(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    SessionTracker *tracker = context;
    const Stepper *stepper = simulator_stepper(simulator);
    int fitted[TOOLS_MOST] = {0};
    for (int k = 0; k < tracker->tool_count; k++)
        fitted[k] = stepper_fitted(stepper, k);
    contrast_injection_fit(tracker->injection, fitted);
    XrayControl flowing = xray ? *xray : (XrayControl){0};   // agent that the lumen does not let through does not count as used
    if (flowing.contrast_ml_s > 0) {
        double inserted[TOOLS_MOST] = {0};
        for (int k = 0; k < tracker->tool_count; k++)
            inserted[k] = stepper_tool_inserted(stepper, k);
        flowing.contrast_ml_s = (float)contrast_injection_flow(tracker->injection, xray, inserted);
    }
    tracker->flow = (double)flowing.contrast_ml_s;
    tracker->xray = flowing;
    score_step(tracker->score, simulator, commands, xray ? &flowing : NULL);
    tracker->injected += tracker->flow * tracker->dt_s;
    if (++tracker->steps % CONTRAST_EVERY != 0)
        return;
    TipPlaces places = find_tips(tracker, stepper);
    contrast_injection_advance(tracker->injection, CONTRAST_EVERY * tracker->dt_s, &flowing, tracker->injected, &places);
    tracker->injected = 0;
}

void session_tracker_publish(void *context, void *out)
{
    const SessionTracker *tracker = context;
    TrackerView *view = out;
    view->score = score_figures(tracker->score);
    view->injected_ml = contrast_injection_injected_ml(tracker->injection);
    view->flow_ml_s = tracker->flow;
    view->contrast_tool = contrast_injection_tool(tracker->injection, &tracker->xray);
    view->node_count = contrast_injection_tree_nodes(tracker->injection);
    view->filling_count = contrast_injection_node_count(tracker->injection) - view->node_count;
    contrast_injection_read(tracker->injection, view->concentration);
}

size_t session_tracker_view_bytes(const SessionTracker *tracker)
{
    return sizeof(TrackerView) + (size_t)contrast_injection_node_count(tracker->injection) * sizeof(float);
}

const Score *session_tracker_score(const SessionTracker *tracker) { return tracker->score; }
