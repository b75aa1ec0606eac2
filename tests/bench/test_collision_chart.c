// The chart of `bench collision` from a small root: it is XML, it holds no NaN or infinity, every figure has its mark and what is missing has none, the
// marks stand where the axes' numbers say.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "bench/collision_chart.h"

#include <expat.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-chart-XXXXXX";
#include "tests/folder.h"

enum { PANELS = 5, TICKS_MOST = 100, MARKS_MOST = 200 };
static const char *const panel_id[PANELS] = {"detect", "error", "growth", "friction", "work"};

typedef struct Tick {
    bool upwards;
    double at, value;
} Tick;
typedef struct Mark {
    double x, y, value;
    char title[128];
} Mark;
typedef struct Panel {
    int ticks, marks, papers, lost, dots, curves;
    Tick tick[TICKS_MOST];
    Mark mark[MARKS_MOST], paper[MARKS_MOST];
    bool not_measured;
} Panel;
typedef struct Page {
    Panel panel[PANELS];
    Panel *now;
    int keys, depth, panel_depth;
    double width, height;
    char text[128];
    Mark *title_of;          // whose <title> comes
    bool in_title;
    Tick *tick_of;           // whose number comes
} Page;

static const char *attribute_of(const char **attribute, const char *name)
{
    for (int i = 0; attribute[i]; i += 2)
        if (!strcmp(attribute[i], name))
            return attribute[i + 1];
    return "";
}

static bool has_no_number(const char *text)
{
    for (const char *at = text; (at = strstr(at, "nan")); at++)
        if (strncmp(at, "nanoseconds", 11) != 0)
            return true;
    return strstr(text, "inf") != NULL;
}

static void on_start(void *data, const char *name, const char **attribute)
{
    Page *page = data;
    const char *class = attribute_of(attribute, "class");
    page->depth++;
    page->text[0] = 0;
    for (int i = 0; attribute[i]; i += 2)
        assert_false(has_no_number(attribute[i + 1]));
    if (!strcmp(name, "svg") && page->width == 0) {
        page->width = atof(attribute_of(attribute, "width"));
        page->height = atof(attribute_of(attribute, "height"));
    }
    page->keys += !strcmp(class, "key");
    for (int k = 0; k < PANELS && !strcmp(class, "panel"); k++)
        if (!strcmp(attribute_of(attribute, "id"), panel_id[k])) {
            page->now = &page->panel[k];
            page->panel_depth = page->depth;
        }
    if (!page->now)
        return;
    Panel *p = page->now;
    if (!strcmp(class, "mark") || !strcmp(class, "paper")) {
        Mark *m = *class == 'm' ? &p->mark[p->marks++] : &p->paper[p->papers++];
        assert_true(p->marks < MARKS_MOST && p->papers < MARKS_MOST);
        assert_int_equal(sscanf(attribute_of(attribute, "transform"), "translate(%lf %lf)", &m->x, &m->y), 2);
        assert_true(m->x > 0 && m->x < page->width && m->y > 0 && m->y < page->height);
        page->title_of = m;
    }
    p->lost += !strcmp(class, "lost");
    p->dots += !strcmp(class, "dot");
    p->curves += !strcmp(name, "polyline");
    if (!strncmp(class, "tick ", 5)) {
        page->tick_of = &p->tick[p->ticks++];
        assert_true(p->ticks < TICKS_MOST);
        page->tick_of->upwards = !strcmp(class, "tick up");
        page->tick_of->at = page->tick_of->upwards ? atof(attribute_of(attribute, "y")) - 4 : atof(attribute_of(attribute, "x"));
    }
}

static void on_text(void *data, const char *text, int length)
{
    Page *page = data;
    size_t used = strlen(page->text);
    snprintf(page->text + used, sizeof page->text - used, "%.*s", length, text);
}

static void on_end(void *data, const char *name)
{
    Page *page = data;
    assert_false(has_no_number(page->text));
    if (!strcmp(name, "title") && page->title_of) {
        strcpy(page->title_of->title, page->text);
        const char *colon = strrchr(page->text, ':');
        assert_non_null(colon);
        page->title_of->value = strtod(colon + 1, NULL);
        page->title_of = NULL;
    }
    if (!strcmp(name, "text") && page->tick_of) {
        char *unit;
        double value = strtod(page->text, &unit);
        page->tick_of->value = value * (*unit == 'k' ? 1e3 : *unit == 'M' ? 1e6 : 1);
        assert_true(page->tick_of->value > 0);
        page->tick_of = NULL;
    }
    if (page->now && !strcmp(page->text, "not measured"))
        page->now->not_measured = true;
    page->text[0] = 0;
    if (page->depth == page->panel_depth)
        page->now = NULL;
    page->depth--;
}

static void draw(const char *json, Page *page)
{
    static Faults faults;
    faults_clear(&faults);
    cJSON *root = cJSON_Parse(json);
    assert_non_null(root);
    assert_true(collision_chart(root, in_folder("chart.svg"), &faults));
    assert_int_equal(faults.count, 0);
    char *text = text_of(in_folder("chart.svg"));
    assert_true(collision_chart(root, in_folder("again.svg"), &faults));
    char *again = text_of(in_folder("again.svg"));
    assert_string_equal(text, again);
    free(again);
    cJSON_Delete(root);
    *page = (Page){0};
    XML_Parser parser = XML_ParserCreate(NULL);
    XML_SetUserData(parser, page);
    XML_SetElementHandler(parser, on_start, on_end);
    XML_SetCharacterDataHandler(parser, on_text);
    if (XML_Parse(parser, text, (int)strlen(text), 1) != XML_STATUS_OK)
        fail_msg("line %lu: %s", XML_GetCurrentLineNumber(parser), XML_ErrorString(XML_GetErrorCode(parser)));
    XML_ParserFree(parser);
    free(text);
    assert_true(page->width == 1200 && page->height > 0);
}

// The two outermost numbers of an axis span it; all others stand at the logarithms between, and so does `value`.
static double read_axis(const Panel *panel, bool upwards, double at)
{
    const Tick *low = NULL, *high = NULL;
    for (int k = 0; k < panel->ticks; k++)
        if (panel->tick[k].upwards == upwards) {
            low = !low || panel->tick[k].value < low->value ? &panel->tick[k] : low;
            high = !high || panel->tick[k].value > high->value ? &panel->tick[k] : high;
        }
    assert_true(low && high && high->value >= 9.99 * low->value);
    double share = (at - low->at) / (high->at - low->at);
    return low->value * pow(high->value / low->value, share);
}

static void check_ticks(const Panel *panel)
{
    for (int k = 0; k < panel->ticks; k++) {
        const Tick *t = &panel->tick[k];
        double found = read_axis(panel, t->upwards, t->at);
        assert_true(fabs(found / t->value - 1) < 0.01);   // places are written to a tenth of a pixel
    }
}

static const char whole[] =
    "{\"rows\":["
    "{\"surface\":\"capsule\",\"representation\":\"lim\",\"motion\":{\"us_per_80_points\":6.5,\"gap_error_um\":{\"rms\":2.5},\"normal_error_deg\":{\"rms\":0.1}"
    "},"
    "\"loop\":{\"survived\":true},\"frictionless\":{\"artificial_mu\":-0.00025,\"work_lost_n\":3e-5},\"paper\":{\"ms\":0.0232}},"
    "{\"surface\":\"capsule\",\"representation\":\"mesh\",\"motion\":{\"us_per_80_points\":31.25,\"gap_error_um\":{\"rms\":8}},\"loop\":{\"survived\":false},"
    "\"frictionless\":{\"artificial_mu\":0.125,\"work_lost_n\":0.004},\"paper\":{\"ms\":4.89}},"
    "{\"surface\":\"a & b <c>\",\"representation\":\"mesh\",\"motion\":{\"us_per_80_points\":2500}},"
    "{\"surface\":\"capsule\",\"representation\":\"tube\",\"motion\":{\"us_per_80_points\":1.5,\"gap_error_um\":{\"rms\":0}},\"frictionless\":{\"artificial_"
    "mu\":0,"
    "\"work_lost_n\":null}},"
    "{\"surface\":\"capsule\",\"representation\":\"grid\",\"frictionless\":{\"artificial_mu\":0.5,\"survived\":false},\"paper\":{\"ms\":4.89}}],"
    "\"growth\":[{\"surface\":\"phantom\",\"search\":\"full\",\"triangles\":1000,\"ns_per_query\":{\"wire\":400,\"spread\":500}},"
    "{\"surface\":\"phantom\",\"search\":\"full\",\"triangles\":4000000,\"ns_per_query\":{\"wire\":900,\"spread\":3000}},"
    "{\"surface\":\"phantom\",\"search\":\"warm\",\"triangles\":1000,\"ns_per_query\":{\"wire\":300}},"
    "{\"surface\":\"tube\",\"search\":\"full\",\"triangles\":1000,\"ns_per_query\":{\"wire\":1,\"spread\":1}}],"
    "\"sizes\":[{\"field\":\"blend\",\"nodes\":100,\"ns_warm\":70,\"ns_cold\":80},{\"field\":\"blend\",\"nodes\":100000,\"ns_warm\":72,\"ns_cold\":300},"
    "{\"field\":\"switch\",\"nodes\":100,\"ns_warm\":1,\"ns_cold\":1}]}";

static void every_figure_has_its_mark(void **state)
{
    (void)state;
    static Page page;
    draw(whole, &page);
    const Panel *detect = &page.panel[0], *error = &page.panel[1], *growth = &page.panel[2], *friction = &page.panel[3], *work = &page.panel[4];
    assert_int_equal(page.keys, 4 + 1);            // and that of a run that did not survive
    assert_int_equal(detect->marks, 4);
    assert_int_equal(detect->papers, 2);           // the same figure of the same surface once
    assert_int_equal(detect->lost, 1);
    assert_int_equal(error->marks, 2);             // the tube's is 0, which no logarithm shows
    assert_int_equal(growth->dots, 2 + 2 + 1 + 2 + 2);
    assert_int_equal(growth->curves, 5);
    assert_int_equal(friction->marks, 3);
    assert_int_equal(friction->lost, 1);
    assert_int_equal(work->marks, 2);
    assert_non_null(strstr(detect->mark[2].title, "a & b <c>, mesh"));
    for (int k = 0; k < PANELS; k++)
        assert_false(page.panel[k].not_measured);
}

static void marks_stand_where_the_axes_say(void **state)
{
    (void)state;
    static Page page;
    draw(whole, &page);
    for (int k = 0; k < PANELS; k++) {
        assert_true(page.panel[k].ticks >= 2);
        check_ticks(&page.panel[k]);
    }
    for (int k = 0; k < PANELS; k++)
        for (int i = 0; i < page.panel[k].marks; i++) {
            const Mark *m = &page.panel[k].mark[i];
            double found = k == 1 ? read_axis(&page.panel[k], true, m->y) : read_axis(&page.panel[k], false, m->x);
            assert_true(fabs(found / fabs(m->value) - 1) < 0.01);
        }
    const Panel *detect = &page.panel[0];
    for (int i = 0; i < detect->papers; i++)
        assert_true(fabs(read_axis(detect, false, detect->paper[i].x) / detect->paper[i].value - 1) < 0.01);
    assert_true(fabs(detect->paper[1].value - 4890) < 1e-6);   // the paper's milliseconds
    assert_true(fabs(page.panel[1].mark[0].value - 2.5) < 1e-6 && fabs(read_axis(&page.panel[1], false, page.panel[1].mark[0].x) / 6.5 - 1) < 0.01);
    // least of all values to greatest, in whole decades
    assert_true(read_axis(detect, false, detect->tick[0].at) <= 1.5 && detect->tick[detect->ticks - 1].value >= 4890);
}

static void what_is_missing_has_no_mark(void **state)
{
    (void)state;
    static Page page;
    static const char *const poor[] = {
        "{}", "{\"rows\":[],\"growth\":[],\"sizes\":[]}", "{\"rows\":{\"a\":1},\"growth\":\"no\",\"sizes\":null}",
        "{\"rows\":[1,null,{\"surface\":5},{\"surface\":\"s\",\"representation\":\"r\",\"motion\":[{\"us_per_80_points\":3}]}]}",
        "{\"rows\":[{\"surface\":\"s\",\"representation\":\"r\",\"motion\":{\"us_per_80_points\":1e999,\"gap_error_um\":{\"rms\":-1}}}]}"};
    for (size_t i = 0; i < sizeof poor / sizeof poor[0]; i++) {
        draw(poor[i], &page);
        for (int k = 0; k < PANELS; k++) {
            assert_true(page.panel[k].not_measured);
            assert_int_equal(page.panel[k].marks + page.panel[k].papers + page.panel[k].dots + page.panel[k].ticks, 0);
        }
    }
    // one value alone has an axis of a decade
    draw("{\"rows\":[{\"surface\":\"s\",\"representation\":\"r\",\"motion\":{\"us_per_80_points\":10}}]}", &page);
    assert_int_equal(page.panel[0].marks, 1);
    check_ticks(&page.panel[0]);
}

static void a_place_that_cannot_be_written_is_reported(void **state)
{
    (void)state;
    static Faults faults;
    cJSON *root = cJSON_Parse(whole);
    assert_false(collision_chart(root, "/nowhere/at/all.svg", &faults));
    assert_int_equal(faults.count, 1);
    cJSON_Delete(root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_figure_has_its_mark), cmocka_unit_test(marks_stand_where_the_axes_say),
                                       cmocka_unit_test(what_is_missing_has_no_mark), cmocka_unit_test(a_place_that_cannot_be_written_is_reported)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
