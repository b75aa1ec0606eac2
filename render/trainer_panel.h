// Fills the data of the panel from the pose of a session or recording: figures of the score, errors, devices, warnings, the mode of the image.
#ifndef SELDINGER_RENDER_TRAINER_PANEL_H
#define SELDINGER_RENDER_TRAINER_PANEL_H

#include "render/operator_controls.h"
#include "render/views.h"
#include "sim/sim.h"

enum { PANEL_FIGURES = 12, PANEL_ERRORS = ERROR_COUNT, PANEL_DEVICES = 14, PANEL_LABELS = 24 };

typedef struct TrainerPanel {
    PanelState state;                // the input of panel_draw; its strings are stored below
    PanelFigure figure[PANEL_FIGURES];
    char error_text[PANEL_ERRORS][96];
    const char *error[PANEL_ERRORS];
    char device_name[PANEL_DEVICES][96], device_note[PANEL_DEVICES][600];
    PanelDevice device[PANEL_DEVICES];
    PanelLabel label[PANEL_LABELS];
    char label_text[PANEL_LABELS][96];
    int fitted[PANEL_TOOLS];         // fitted device that the texts in `tool` describe
    char tool[PANEL_TOOLS][200], tool_note[PANEL_TOOLS][64], target[96], warning[200];
    char task[4200], result[4200];   // with the names of keys
    int mark_count;
    ScoreMark mark[SCORE_MARKS_MOST];
    char spot_text[SCORE_MARKS_MOST][64];
} TrainerPanel;

// Sets the constant data of a session: scene, exercise, tool.
void trainer_panel_begin(TrainerPanel *panel, const Scene *scene, const char *trainee);
// Shows the current pose, score and controls. `figures` NULL: no real time (a recording).
void trainer_panel_show(TrainerPanel *panel, const Scene *scene, const Pose *pose, const ScoreFigures *score, const RealtimeFigures *figures,
                        const XrayControl *xray);
// Shows the settings of the controls and the views; call after drawing them.
void trainer_panel_views(TrainerPanel *panel, const OperatorControls *controls, Views *views, const XrayControl *xray);
// Shows the actual flow of the requested contrast agent, and the tool (-1: none has a lumen); call after trainer_panel_views.
void trainer_panel_injection(TrainerPanel *panel, const Scene *scene, int tool, double flow_ml_s, const XrayControl *xray);
// Shows the present grip, in a session; call after trainer_panel_show. Locked tools share the sum of their reactions, which is shown.
void trainer_panel_grip(TrainerPanel *panel, const HandGrip *grip);

#endif
