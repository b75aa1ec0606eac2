// A scene from text with its simulator and score, stepped by the test: shared by the tests of score and sessions.
#ifndef SELDINGER_TESTS_SCORE_SCENE_H
#define SELDINGER_TESTS_SCORE_SCENE_H

#include "sim/score.h"

#include <stdlib.h>
#include <string.h>

#define TOOL "wire: {elements: 40, sections: [{length_mm: 100, diameter_mm: 0.4, young_modulus_gpa: 20}], damping: {mass_1_s: 1, stiffness_s: 0.0005}}\n"
#define AT(x) "targets: [{name: there, point_mm: [" #x ", 0, 0], radius_mm: 1}]\n"
#define IN_THE_OPEN "seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n" AT(20)
// A catheter with a wire in it; `rest` is the catheter's, e.g. "rest: [{arc: {radius_mm: 8, angle_deg: 90}}], ".
#define TWO_TOOLS(rest)                                                                                                                                        \
    "tools:\n"                                                                                                                                                 \
    "  - {name: catheter, kind: catheter, elements: 30, inserted_mm: 2, sections: [{length_mm: 60, diameter_mm: 1, inner_diameter_mm: 0.7, "                   \
    "young_modulus_gpa: 0.5, density_g_cm3: 1.5}], " rest "damping: {mass_1_s: 1, stiffness_s: 0.0005}}\n"                                                     \
    "  - {name: wire, kind: wire, elements: 40, inserted_mm: 2, sections: [{length_mm: 100, diameter_mm: 0.4, young_modulus_gpa: 20}]}\n"
#define TWO_IN_THE_OPEN "seldinger: 1\n" TWO_TOOLS("") "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n" AT(20)
#define EXERCISE(inner) "exercise: {title: Go there, target: there" inner "}\n"

typedef struct Practice {
    Faults faults;
    Scene *scene;
    Vessel *vessel;
    Simulator *simulator;
    Score *score;
    XrayControl xray;
    bool watched;            // xray is used
} Practice;

static void practice_end(Practice *p)
{
    score_free(p->score);
    simulator_destroy(p->simulator);
    if (p->vessel)
        p->vessel->destroy(p->vessel);
    scene_free(p->scene);
    free(p);
}

static Practice *practice_begin(const char *text, const VesselTree *tree)
{
    Practice *p = calloc(1, sizeof *p);
    assert_non_null(p);
    p->scene = scene_parse(text, strlen(text), "test.yaml", &p->faults);
    if (!p->scene)
        fail_msg("%s", p->faults.text[0]);
    if (p->scene->source == SOURCE_TUBE)
        p->vessel = tube_vessel_create(&p->scene->tube, "test", &p->faults);
    p->simulator = simulator_create(p->scene, p->vessel, &p->faults);
    assert_non_null(p->simulator);
    p->score = score_create(p->simulator, tree);
    assert_non_null(p->score);
    p->xray = xray_default_control();
    return p;
}

static void practice_step_tools(Practice *p, const ToolCommands *commands)
{
    simulator_step(p->simulator, commands);
    score_step(p->score, p->simulator, commands, p->watched ? &p->xray : NULL);
}

static inline void practice_step(Practice *p, double push_mm_s) { practice_step_tools(p, &(ToolCommands){.tool = {{push_mm_s, 0}}}); }

static inline ScoreFigures practice_go_tools(Practice *p, double outer_mm_s, double inner_mm_s, double seconds)
{
    for (int i = 0, steps = (int)(seconds * 1000 / p->scene->dt + 0.5); i < steps; i++)
        practice_step_tools(p, &(ToolCommands){.tool = {{outer_mm_s, 0}, {inner_mm_s, 0}}});
    return score_figures(p->score);
}

static inline ScoreFigures practice_go(Practice *p, double push_mm_s, double seconds)
{
    for (int i = 0, steps = (int)(seconds * 1000 / p->scene->dt + 0.5); i < steps; i++)
        practice_step(p, push_mm_s);
    return score_figures(p->score);
}

#endif
