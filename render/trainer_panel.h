// Fills the panel's data from a pose of a session or recording: figures of the score, errors, devices, warnings, the image's mode.
#ifndef SELDINGER_RENDER_TRAINER_PANEL_H
#define SELDINGER_RENDER_TRAINER_PANEL_H

#include "render/operator_controls.h"
#include "render/views.h"
#include "sim/sim.h"

enum { PANEL_FIGURES = 12, PANEL_ERRORS = 12, PANEL_DEVICES = 14, PANEL_LABELS = 24 };

typedef struct TrainerPanel {
    PanelState state;                // what panel_draw takes; its strings lie below
    PanelFigure figure[PANEL_FIGURES];
    char error_text[PANEL_ERRORS][96];
    const char *error[PANEL_ERRORS];
    char device_name[PANEL_DEVICES][96], device_note[PANEL_DEVICES][600];
    PanelDevice device[PANEL_DEVICES];
    PanelLabel label[PANEL_LABELS];
    char label_text[PANEL_LABELS][96];
    int fitted[PANEL_TOOLS];         // whose words `tool` holds
    char tool[PANEL_TOOLS][200], tool_note[PANEL_TOOLS][64], target[96], warning[200];
    char instructions[4200];
} TrainerPanel;

// Scene, exercise, tool: constant data of a session.
void trainer_panel_begin(TrainerPanel *panel, const Scene *scene, const char *trainee);
// Pose, score and controls of now. `figures` NULL: no real time (a recording).
void trainer_panel_show(TrainerPanel *panel, const Scene *scene, const Pose *pose, const ScoreFigures *score, const RealtimeFigures *figures,
                        const XrayControl *xray);
// Settings of the controls and the views; to be called after drawing them.
void trainer_panel_views(TrainerPanel *panel, const OperatorControls *controls, Views *views, const XrayControl *xray);
// Actual flow of the requested contrast agent, and the tool (-1: none has a lumen); to be called after trainer_panel_views.
void trainer_panel_injection(TrainerPanel *panel, const Scene *scene, int tool, double flow_ml_s, const XrayControl *xray);
// The present grip, in a session; to be called after trainer_panel_show. Locked tools share the sum of their reactions, which is shown.
void trainer_panel_grip(TrainerPanel *panel, const HandGrip *grip);

#endif
