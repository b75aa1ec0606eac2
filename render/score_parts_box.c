#include "render/score_parts_box.h"
#include "render/translation.h"

#include <math.h>
#include <stdio.h>

enum { COLUMNS = 4 };

typedef struct Box {
    Gui *gui;
    GuiFont font;
    float x[COLUMNS];            // where columns begin; the last is that of the other session
} Box;

static void print_row(const Box *box, Color color, const char *const text[COLUMNS])
{
    GuiRect at = gui_place(box->gui, 0, gui_line_height(box->gui, box->font) + 2 * gui_scale(box->gui));
    for (int i = 0; i < COLUMNS; i++)
        gui_draw_text(box->gui, at.x + box->x[i], at.y, box->font, i == 0 ? gui_colors.dim : color, text[i]);
}

// "12.3 of 20.0", a dash where the part is not judged.
static void print_points(const ScorePartFigures *judged, char text[40])
{
    snprintf(text, 40, "\u2013");
    if (judged->most > 0)
        snprintf(text, 40, "%.1f of %.1f", judged->points, judged->most);
}

// The reason for lost points has a line of its own.
static void print_part(const Box *box, const ScoreFigures *f, const ScoreFigures *beside, ScorePart part)
{
    const ScorePartFigures *judged = &f->judged[part];
    char title[100], points[40], measured[60], other[100] = "", why[120];
    snprintf(title, sizeof title, "%s [%s]", tr(score_part_words[part].title), tr(score_part_words[part].unit));
    print_points(judged, points);
    if (judged->most > 0)
        snprintf(measured, sizeof measured, tr("%.3g (full up to %.3g)"), judged->measured, judged->par);
    else
        snprintf(measured, sizeof measured, tr("%.3g (not scored)"), judged->measured);
    if (beside) {
        char theirs[40];
        print_points(&beside->judged[part], theirs);
        snprintf(other, sizeof other, "%s at %.3g", theirs, beside->judged[part].measured);
    }
    score_part_reason(f, part, why, sizeof why);
    print_row(box, *why ? gui_colors.warning : gui_colors.text, (const char *const[COLUMNS]){title, points, measured, other});
    if (*why) {
        GuiRect at = gui_place(box->gui, 0, gui_line_height(box->gui, box->font) + 2 * gui_scale(box->gui));
        gui_draw_text(box->gui, at.x + 14 * gui_scale(box->gui), at.y, box->font, gui_colors.warning, why);
    }
}

static void print_errors(const Box *box, const ScoreFigures *f, const ScoreFigures *beside)
{
    for (int i = 0; i < ERROR_COUNT; i++) {
        char count[40], last[60] = "", other[40] = "";
        if (f->error[i].count == 0 && !(beside && beside->error[i].count > 0))
            continue;
        snprintf(count, sizeof count, "%d", f->error[i].count);
        if (f->error[i].count > 0)
            snprintf(last, sizeof last, tr("last at %.2f s%s"), f->error[i].last_s, f->error[i].is_on ? tr(", now") : "");
        if (beside)
            snprintf(other, sizeof other, "%d", beside->error[i].count);
        print_row(box, f->error[i].count > 0 ? gui_colors.bad : gui_colors.text, (const char *const[COLUMNS]){score_error_words[i], count, last, other});
    }
}

void score_parts_box(Gui *gui, const ScoreFigures *f, const ScoreFigures *beside, GuiRect over, float window_width)
{
    const float s = gui_scale(gui), width = fminf(680 * s, window_width - 16 * s), left = fminf(over.x + 8 * s, window_width - width - 8 * s);
    const Box box = {gui, GUI_SMALL, {0, 0.36F * width, 0.51F * width, 0.73F * width}};
    char title[120], text[160];
    int rows = PART_COUNT + 2;
    for (int i = 0; i < PART_COUNT; i++) {
        score_part_reason(f, (ScorePart)i, text, sizeof text);
        rows += *text != 0;
    }
    for (int i = 0; i < ERROR_COUNT; i++)
        rows += f->error[i].count > 0 || (beside && beside->error[i].count > 0);
    // the parts are judged with every step, so they are those of the moment
    const float height = (float)rows * (gui_line_height(gui, GUI_SMALL) + 5 * s) + gui_line_height(gui, GUI_NORMAL) + 16 * s;
    gui_window_begin(gui, "score-parts", (GuiRect){left, over.y + 34 * s, width, fminf(height, over.height - 42 * s)}, GUI_ON_TOP | GUI_FRAMED);
    snprintf(title, sizeof title, "%.0f points after %.1f s, %s", f->points, f->time_s,
             f->state == SCORE_REACHED    ? "target held"
             : f->state == SCORE_TIME_OUT ? "out of time"
                                          : "target not yet held");
    if (beside)
        snprintf(text, sizeof text, tr("%s; beside: %.0f after %.1f s"), title, beside->points, beside->time_s);
    gui_text(gui, GUI_NORMAL, gui_colors.text, beside ? text : title);
    print_row(&box, gui_colors.dim, (const char *const[COLUMNS]){"Part", "Points", "Measured", beside ? "Beside" : ""});
    for (int i = 0; i < PART_COUNT; i++)
        print_part(&box, f, beside, (ScorePart)i);
    print_errors(&box, f, beside);
    if (f->state != SCORE_REACHED) {
        snprintf(text, sizeof text, tr("Only %.0f %% of these points count until the target is held."), 100 * score_share(f));
        gui_text(gui, GUI_SMALL, gui_colors.dim, text);
    }
    gui_window_end(gui);
}
