#include "render/session_page.h"

#include "render/key_table.h"
#include "render/page.h"

#include <stdlib.h>
#include <string.h>

static const char own_style[] =
    ".points{font-size:2.6rem;font-weight:700;line-height:1;font-variant-numeric:tabular-nums}\n"
    ".points small{font-size:1rem;font-weight:400;color:var(--muted)}\n"
    ".top{display:flex;flex-wrap:wrap;gap:.5rem 2.5rem;align-items:center;margin:1rem 0}\n"
    ".state{font-weight:600;padding:.15rem .6rem;border:2px solid currentColor;border-radius:1rem}\n"
    ".state.reached{color:var(--o3)}.state.time_out,.state.running,.state.waiting{color:var(--bad)}\n"
    ".bar{fill:currentColor}.error{stroke:var(--bad);fill:none;stroke-dasharray:3 3}text.error{stroke:var(--panel);stroke-dasharray:none}\n"
    "svg text.error{fill:var(--bad)}circle.error{stroke-width:2;stroke-dasharray:none}\n"
    ".vessel path{fill:none;stroke:var(--muted);stroke-linecap:round}.vessel circle{fill:var(--muted)}.vessel{opacity:.32}svg.view{margin:0;max-width:none}\n"
    ".halo{fill:none;stroke:#fff;stroke-width:5;stroke-linejoin:round;stroke-linecap:round}.way{fill:none;stroke-width:2.6;stroke-linejoin:round}\n"
    ".tool{fill:none;stroke:var(--ink);stroke-width:1}.held{fill:currentColor}.missed{fill:var(--panel);stroke:currentColor;stroke-width:2}\n"
    "tr.own{background:var(--panel);font-weight:600}td.mark-letter{color:var(--bad);font-weight:700}meter{width:7rem}\n"
    "@media print{body{font-size:10pt}section{break-inside:auto}figure{max-width:100%}}\n";

static void item(FILE *out, const char *term, const char *text)
{
    fprintf(out, "<dt>%s</dt><dd>", term);
    page_text(out, *text ? text : "not given");
    fprintf(out, "</dd>\n");
}

static void print_top(const SessionPage *page)
{
    static const char *const words[] = {"not started", "target not held", "target held", "out of time"};
    FILE *out = page->out;
    const Session *s = page->session;
    const ScoreFigures *f = &s->figures;
    fprintf(out, "<section id=\"summary\"><div class=\"top\">");
    if (f->has_exercise)
        fprintf(out, "<div class=\"points\">%.0f <small>of 100 points</small></div><div class=\"state %s\">%s</div>", f->points, score_state_name[f->state],
                words[f->state]);
    fprintf(out, "</div>\n<dl>\n");
    item(out, "Trainee", s->trainee);
    item(out, "Date", s->date);
    item(out, "Device", s->device);
    item(out, "Mode", s->is_examination ? "examination: without 3D view and angioscopy" : "practice");
    item(out, "Target", s->target);
    fprintf(out, "</dl></section>\n");
}

// The figures with the points of each part. Sessions of older versions do not hold them: they follow from the exercise if its scene is known.
static ScoreFigures with_points(const SessionPage *page)
{
    ScoreFigures f = page->session->figures;
    double most = 0;
    for (int i = 0; i < PART_COUNT; i++)
        most += f.judged[i].most;
    if (most <= 0 && page->scene && page->scene->exercise)
        score_parts_judge(&f, page->scene->exercise);
    return f;
}

static void print_part(FILE *out, const ScoreFigures *f, ScorePart part)
{
    const ScorePartFigures *judged = &f->judged[part];
    char why[120];
    score_part_reason(f, part, why, sizeof why);
    fprintf(out, "<tr><th scope=\"row\">%s [%s]</th>", score_part_words[part].title, score_part_words[part].unit);
    if (judged->most > 0)
        fprintf(out,
                "<td>%.2f</td><td>%g</td><td>%.1f of %.1f</td><td class=\"words\"><meter min=\"0\" max=\"1\" value=\"%.3f\">%.0f %%</meter></td><td "
                "class=\"words\">%s</td></tr>\n",
                judged->measured, judged->par, judged->points, judged->most, f->part[part], 100 * f->part[part], why);
    else
        fprintf(out, "<td>%.2f</td><td>not scored</td><td>–</td><td class=\"words\">–</td><td class=\"words\"></td></tr>\n", judged->measured);
}

static void print_parts(const SessionPage *page)
{
    FILE *out = page->out;
    const ScoreFigures f = with_points(page);
    const Exercise *e = page->scene ? page->scene->exercise : NULL;
    if (!f.has_exercise)
        return;
    fprintf(out, "<section id=\"parts\"><h2>Points</h2>\n<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Part</th><th scope=\"col\">Measured</th><th "
                 "scope=\"col\">Full points up to</th><th scope=\"col\">Points</th><th scope=\"col\" class=\"words\">Reached</th><th scope=\"col\" "
                 "class=\"words\">Why points were lost</th></tr></thead><tbody>\n");
    for (int i = 0; i < PART_COUNT; i++)
        print_part(out, &f, (ScorePart)i);
    fprintf(out, "</tbody></table></div>\n<p>The points of the parts are added, ");
    if (f.state == SCORE_REACHED)
        fprintf(out, "in full since the target was held");
    else
        fprintf(out, "multiplied by half of the fraction of the distance covered (%.0f %%), since the target was not held", 200 * score_share(&f));
    if (e && f.error_total > 0)
        fprintf(out, "; minus %g points for %d error%s", score_lost_to_errors(&f, e), f.error_total, f.error_total == 1 ? "" : "s");
    fprintf(out, ".</p></section>\n");
}

static void print_figures(const SessionPage *page)
{
    FILE *out = page->out;
    const ScoreFigures *f = &page->session->figures;
    char planes[120] = "";
    if (f->second_kerma_mgy > 0)
        snprintf(planes, sizeof planes, " (first plane %.2f mGy, %.3f Gy cm²; second plane %.2f mGy, %.3f Gy cm²)", f->air_kerma_mgy - f->second_kerma_mgy,
                 f->kerma_area_gy_cm2 - f->second_kerma_area_gy_cm2, f->second_kerma_mgy, f->second_kerma_area_gy_cm2);
    fprintf(out,
            "<section id=\"figures\"><h2>Figures</h2>\n<dl>\n<dt>Path of the tip</dt><dd>%.0f mm; straight distance to the target %.0f mm; efficiency %.0f "
            "%%</dd>\n"
            "<dt>%s</dt><dd>pushed in %.0f mm, pulled back %.0f mm in total</dd>\n<dt>Forces</dt><dd>wall at most %.3f N, over time %.2f N s; tip at most %.3f "
            "N (mean over 20 ms)</dd>\n",
            f->path_mm, f->way_mm, 100 * f->efficiency, f->tool_count > 1 ? "Tools" : "Tool", f->inserted_mm, f->withdrawn_mm, f->wall_force_peak_n,
            f->wall_impulse_n_s, f->tip_force_peak_n);
    if (f->has_xray)
        fprintf(
            out,
            "<dt>X-rays</dt><dd>%.1f s, %lld pulses, %.0f cm² of open field summed over pulses; contrast agent %.1f ml</dd>\n"
            "<dt>Dose</dt><dd>air kerma at the patient entrance reference point %.2f mGy, dose-area product %.3f Gy cm²%s; tube at %.0f kV and %.0f mA in the "
            "mean of the pulses (a model, not a measurement)</dd>\n"
            "<dt>Sight</dt><dd>tools were moved by %.1f mm without a fresh X-ray image (pulling counts half), and for %.1f s with the 3D view or "
            "angioscopy in sight</dd>\n",
            f->fluoroscopy_s, (long long)f->pulses, f->dose_area_cm2, f->contrast_ml, f->air_kerma_mgy, f->kerma_area_gy_cm2, planes, f->mean_kv, f->mean_ma,
            f->blind_total_mm, f->guided_s);
    else
        fprintf(out, "<dt>X-rays</dt><dd>none: a headless run</dd>\n");
    fprintf(out, "</dl></section>\n");
}

static void print_tools(const SessionPage *page)
{
    FILE *out = page->out;
    const ScoreFigures *f = &page->session->figures;
    if (f->tool_count < 2)
        return;
    fprintf(out, "<section id=\"tools\"><h2>Tools</h2>\n<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Tool</th><th scope=\"col\">Pushed in "
                 "[mm]</th><th scope=\"col\">Pulled back [mm]</th><th scope=\"col\">Tip force [N]</th><th scope=\"col\">Tip speed, hand at rest "
                 "[mm/s]</th><th scope=\"col\">Tip behind the one around it [mm]</th></tr></thead><tbody>\n");
    for (int k = 0; k < f->tool_count; k++) {
        const ScoreToolFigures *tool = &f->tool[k];
        fprintf(out, "<tr><th scope=\"row\">");
        page_text(out, tool->name);
        fprintf(out, "</th><td>%.0f</td><td>%.0f</td><td>%.3f</td><td>%.0f</td>", tool->inserted_mm, tool->withdrawn_mm, tool->tip_force_peak_n,
                tool->kick_peak_mm_s);
        if (k > 0)
            fprintf(out, "<td>%.1f</td></tr>\n", tool->behind_mm);
        else
            fprintf(out, "<td>–</td></tr>\n");
    }
    fprintf(out, "</tbody></table></div><p>Forces and speeds are the maxima of the session; the position of the tip is that at its end.</p></section>\n");
}

static void print_errors(const SessionPage *page)
{
    FILE *out = page->out;
    const Session *s = page->session;
    fprintf(out, "<section id=\"errors\"><h2>Handling errors</h2>\n");
    if (s->figures.error_total == 0) {
        fprintf(out, "<p>None.</p></section>\n");
        return;
    }
    fprintf(out, "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Mark</th><th scope=\"col\" class=\"words\">Error</th><th "
                 "scope=\"col\">Times</th><th scope=\"col\" class=\"words\">Started at [s]</th></tr></thead><tbody>\n");
    for (int kind = 0; kind < ERROR_COUNT; kind++) {
        if (s->figures.error[kind].count == 0)
            continue;
        const char *comma = "";
        fprintf(out, "<tr><td class=\"mark-letter\">%c</td><td class=\"words\">%s</td><td>%d</td><td class=\"words\">", session_error_letter((ScoreError)kind),
                score_error_words[kind], s->figures.error[kind].count);
        for (int i = 0; i < s->event_count; i++)
            if (s->event[i].kind == (ScoreError)kind) {
                fprintf(out, "%s%.2f", comma, s->event[i].time_s);
                if (s->figures.tool_count > 1 && s->event[i].tool >= 0) {
                    fprintf(out, " (");
                    page_text(out, s->figures.tool[s->event[i].tool].name);
                    fprintf(out, ")");
                }
                comma = ", ";
            }
        fprintf(out, "</td></tr>\n");
    }
    fprintf(out, "</tbody></table></div></section>\n");
}

static void print_consequences(const SessionPage *page)
{
    FILE *out = page->out;
    const ScoreFigures *f = &page->session->figures;
    if (!f->has_consequences)
        return;
    fprintf(out, "<section id=\"consequences\"><h2>Consequences</h2>\n");
    if (f->mark_count == 0)
        fprintf(out, "<p>None: the vessel was not hurt.</p>");
    for (int i = 0; i < f->mark_count; i++) {
        const ScoreMark *mark = &f->mark[i];
        fprintf(out, "<p>%.2f s: %s at (%.1f, %.1f, %.1f) mm", mark->time_s, score_error_words[mark->kind], mark->at.x, mark->at.y, mark->at.z);
        if (mark->limit_n > 0)
            fprintf(out, "; force on the tip %.3f N, %s %.3f N", mark->force_n, mark->kind == ERROR_SPASM ? "a perforation needs" : "limit", mark->limit_n);
        if (mark->leaked_ml > 0)
            fprintf(out, "; %.2f ml of contrast agent leaked", mark->leaked_ml);
        fprintf(out, ".</p>\n");
    }
    if (f->narrowest < 1)
        fprintf(out, "<p>Spasm narrowed the vessel to %.0f %% of its radius at most.</p>", 100 * f->narrowest);
    fprintf(out, "</section>\n");
}

static void print_steps(const SessionPage *page)
{
    FILE *out = page->out;
    const GuideProgress *progress = &page->session->figures.guide;
    const Guide *guide = page->scene && page->scene->exercise ? &page->scene->exercise->guide : NULL;
    const int count = guide ? guide->count : progress->done;
    char text[2 * GUIDE_TEXT];
    if (count == 0)
        return;
    fprintf(out, "<section id=\"steps\"><h2>Steps</h2>\n<ol>\n");
    for (int i = 0; i < count; i++) {
        fprintf(out, "<li>");
        page_text(out, guide ? key_table_fill(guide->step[i].text, text, sizeof text) : "");
        if (i < progress->done)
            fprintf(out, " (done at %.1f s)</li>\n", progress->done_s[i]);
        else
            fprintf(out, " (not done)</li>\n");
    }
    fprintf(out, "</ol></section>\n");
}

static void print_earlier(const SessionPage *page)
{
    FILE *out = page->out;
    fprintf(out, "<section id=\"earlier\"><h2>Sessions of this trainee at this exercise</h2>\n");
    if (page->broken > 0)
        fprintf(out, "<p>%d session file%s in the folder could not be read and %s left out.</p>\n", page->broken, page->broken == 1 ? "" : "s",
                page->broken == 1 ? "is" : "are");
    if (page->earlier_count < 2) {
        fprintf(out, "<p>No other session was found.</p></section>\n");
        return;
    }
    session_trend_figure(page);
    fprintf(out, "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">No.</th><th scope=\"col\" class=\"words\">Date</th><th "
                 "scope=\"col\">Points</th><th scope=\"col\" class=\"words\">Target</th><th scope=\"col\">Time [s]</th><th scope=\"col\">X-rays [s]</th><th "
                 "scope=\"col\">Contrast [ml]</th><th scope=\"col\">Path / straight</th>"
                 "<th scope=\"col\">Wall force [N]</th><th scope=\"col\">Errors</th></tr></thead><tbody>\n");
    for (int i = 0; i < page->earlier_count; i++) {
        const Session *s = &page->earlier[i];
        bool own = !strcmp(s->date, page->session->date) && !strcmp(s->series_sha256, page->session->series_sha256);
        fprintf(out,
                "<tr%s><th scope=\"row\">%d</th><td class=\"words\">%s</td><td>%.0f</td><td "
                "class=\"words\">%s</td><td>%.1f</td><td>%.1f</td><td>%.1f</td><td>%.2f</td><td>%.3f</td>"
                "<td>%d</td></tr>\n",
                own ? " class=\"own\"" : "", i + 1, s->date, s->figures.points, s->figures.state == SCORE_REACHED ? "held" : "not held", s->figures.time_s,
                s->figures.fluoroscopy_s, s->figures.contrast_ml, s->figures.way_mm > 0 ? s->figures.path_mm / s->figures.way_mm : 0,
                s->figures.wall_force_peak_n, s->figures.error_total);
    }
    fprintf(out, "</tbody></table></div></section>\n");
}

static void print_origin(const SessionPage *page)
{
    FILE *out = page->out;
    const Session *s = page->session;
    char steps[96];
    snprintf(steps, sizeof steps, "%lld steps of %g ms, last state %016llx", (long long)s->steps, s->step_ms, (unsigned long long)s->state_hash);
    fprintf(out, "<footer><section id=\"origin\"><h2>Origin</h2>\n<dl>\n");
    item(out, "Session", page->path);
    item(out, "Scene", s->scene_path);
    item(out, "Recording", s->recording_path);
    item(out, "Recorded", steps);
    fprintf(out, "<dt>Recording belongs to this session</dt><dd>%s</dd>\n",
            !page->run         ? "missing: no plots"
            : page->run_is_its ? "yes, the checksum of its series matches"
                               : "no");
    item(out, "Made by", s->version);
    fprintf(out, "</dl>\n<p>Written by seldinger " SELDINGER_VERSION ".</p></section></footer>");
}

void session_page(const SessionPage *page)
{
    FILE *out = page->out;
    const Session *s = page->session;
    const char *title = *s->title ? s->title : "Session without an exercise";
    page_begin(out, "Session", title, own_style);
    fprintf(out, "<p class=\"notice\" role=\"note\"><strong>For training and research. Not a medical device:</strong> points compare sessions at this "
                 "simulator; they say nothing about the treatment of patients.</p>\n");
    if (page->run && !page->run_is_its)
        fprintf(out, "<p class=\"notice\" role=\"alert\">The recording in the folder belongs to another session: plots and path below are not those of this "
                     "session.</p>\n");
    fprintf(out, "</header>\n<main>\n");
    print_top(page);
    print_parts(page);
    print_errors(page);
    print_consequences(page);
    print_steps(page);
    fprintf(out, "<section id=\"time\"><h2>Over time</h2>\n");
    session_time_figure(page);
    fprintf(out, "%s</section>\n<section id=\"path\"><h2>Path of the tip</h2>\n", page->run ? "" : "<p>The recording was not found.</p>");
    session_path_figure(page);
    fprintf(out, "%s</section>\n",
            !page->run                   ? "<p>The recording was not found.</p>"
            : page->run->frame_count < 1 ? "<p>The recording is too long for this figure, or contains no frames.</p>"
                                         : "");
    print_figures(page);
    print_tools(page);
    print_earlier(page);
    fprintf(out, "</main>\n");
    print_origin(page);
    fprintf(out, "</body></html>\n");
}
