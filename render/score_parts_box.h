// The parts of a score at a moment as a box over a view: points, measure, reason for lost points; beside another session's.
#ifndef SELDINGER_RENDER_SCORE_PARTS_BOX_H
#define SELDINGER_RENDER_SCORE_PARTS_BOX_H

#include "render/gui.h"
#include "sim/sim.h"

// In the upper left corner of the view `over`, between gui_begin() and gui_end(); beyond its right edge where it is too narrow, within the window. `beside` NULL: one
// session.
void score_parts_box(Gui *gui, const ScoreFigures *figures, const ScoreFigures *beside, GuiRect over, float window_width);

#endif
