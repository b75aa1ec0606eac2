// Formatting of text, numbers and signs for the panel.
#include "render/panel_internal.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *const panel_sign[MARK_BAD + 1] = {"", "\u2713 ", "\u25b2 ", "\u2717 "};
const char *const panel_mode_name[PANEL_CINE + 1] = {"LIVE", "LAST IMAGE", "DSA", "ROADMAP", "CINE"};

Color panel_mark_color(PanelMark mark) { return (const Color[]){gui_colors.text, gui_colors.good, gui_colors.warning, gui_colors.bad}[mark]; }

const char *panel_text(const char *text) { return text ? text : ""; }

// "12.3 mm", a dash for unknown values; never "-0.0".
const char *panel_figure(char *text, size_t capacity, double value, int decimals, const char *unit)
{
    const char *blank = unit[0] && strncmp(unit, "\u00b0", 2) != 0 ? " " : "";   // 35 mm, but 35\u00b0
    if (isfinite(value))
        snprintf(text, capacity, "%.*f%s%s", decimals, fabs(value) < 0.5 * pow(10, -decimals) ? 0.0 : value, blank, unit);
    else
        snprintf(text, capacity, "\u2013%s%s", blank, unit);
    return text;
}

const char *panel_minutes(char *text, size_t capacity, double s)
{
    if (isfinite(s) && s >= 0 && s < 1e6)
        snprintf(text, capacity, "%d:%02d", (int)s / 60, (int)s % 60);
    else
        snprintf(text, capacity, "\u2013");
    return text;
}

bool panel_has_more_lines(const char *text)
{
    const char *end = strchr(panel_text(text), '\n');
    return end && end[strspn(end, " \n\r\t")];
}

// First line of the instructions; false if there is none.
bool panel_first_line(const char *text, char *line, size_t capacity)
{
    snprintf(line, capacity, "%.*s", (int)strcspn(panel_text(text), "\n"), panel_text(text));
    return line[0] != 0;
}

void panel_heading(Panel *panel, const char *text)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), line = gui_line_height(gui, GUI_SMALL), width, height;
    GuiRect at = gui_place(gui, 0, line + floorf(3 * s));
    gui_text_extent(gui, GUI_SMALL, text, &width, &height);
    gui_draw_text(gui, at.x, at.y + floorf(2 * s), GUI_SMALL, gui_colors.accent, text);
    gui_draw_fill(gui, (GuiRect){at.x + width + 6 * s, at.y + floorf(2 * s + height / 2), at.width - width - 6 * s, 1}, gui_colors.line);
}
