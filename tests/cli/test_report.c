// `info --report`: a self-contained page. Its markup, which is also XML, is checked for references to other files and for its figures; then a real browser
// shows it: the figures are visible and coloured, there are no error messages and no network requests. The browser's part is skipped by name if there is none.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "geom/vessel_branches.h"
#include "recon/tree_file.h"

#include <expat.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-report-XXXXXX";
#include "tests/folder.h"
static const char *browser;  // NULL: none
static int branch_count;      // of the model

// The fitted phantom, with a stenosis of half the radius in the middle of its first branch.
static int make_model(void)
{
    static Faults faults;
    char command[1000];
    snprintf(command, sizeof command,
             "%s synth phantom --points 50 --sac-points 400 --quiet -o '%s' && %s fit '%s' -o '%s' --target-mm 0.2 --voxel-mm 0.4 --quiet", SELDINGER_PROGRAM,
             in_folder("tree.h5"), SELDINGER_PROGRAM, in_folder("tree.h5"), in_folder("plain.h5"));
    if (system(command) != 0)
        return -1;
    VesselTree *tree = tree_file_load(in_folder("plain.h5"), NULL, &faults);
    VesselBranches *branches = tree ? vessel_branches_create(tree) : NULL;
    if (!branches)
        return -1;
    branch_count = branches->count;
    for (int k = -2; k <= 2; k++)
        tree->radius[branches->node[branches->branch[0].first + branches->branch[0].count / 2 + k]] *= 0.5;
    TreeFileInfo info = {.source = (char[]){"phantom"}, .parameters = (char[]){"fit:\n  voxel_mm: 0.4\n"}, .created_by = (char[]){"a test"}};
    bool good = tree_file_save(tree, &info, in_folder("model.h5"), &faults);
    vessel_branches_free(branches);
    vessel_tree_free(tree);
    return good ? 0 : -1;
}

static int set_up(void **state)
{
    static const char *const names[] = {"chromium", "chromium-browser", "google-chrome"};
    for (int i = 0; i < 3 && !browser; i++) {
        char command[100];
        snprintf(command, sizeof command, "command -v %s >/dev/null 2>&1", names[i]);
        browser = system(command) == 0 ? names[i] : NULL;
    }
    return make_folder(state) == 0 ? make_model() : -1;
}

static int info(const char *arguments)
{
    char command[1000];
    snprintf(command, sizeof command, "%s info %s >'%s' 2>&1", SELDINGER_PROGRAM, arguments, in_folder("out.txt"));
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// --- the markup ---

typedef struct Seen {
    int svg, titled, tables, figures, sections, external, scripts, unnamed_images;
    int depth, svg_depth;
    bool has_notice;
    char text[1 << 16];
    size_t length;
} Seen;

static void on_start(void *data, const char *name, const char **attribute)
{
    Seen *seen = data;
    bool named = false;
    seen->depth++;
    for (int i = 0; attribute[i]; i += 2) {
        const char *key = attribute[i], *value = attribute[i + 1];
        seen->external += !strcmp(key, "src") || !strcmp(key, "href") || !strcmp(key, "xlink:href") || !strcmp(key, "action") || strstr(value, "//") != NULL ||
                          strstr(value, "url(") != NULL;
        seen->scripts += !strncmp(key, "on", 2);
        named = named || (!strcmp(key, "aria-labelledby") && *value);
        seen->has_notice = seen->has_notice || (!strcmp(key, "class") && !strcmp(value, "notice"));
    }
    if (!strcmp(name, "svg")) {
        seen->svg++;
        seen->svg_depth = seen->depth;
        seen->unnamed_images += !named;
    }
    seen->titled += (!strcmp(name, "title") || !strcmp(name, "desc")) && seen->depth == seen->svg_depth + 1 && seen->svg_depth > 0;
    seen->tables += !strcmp(name, "table");
    seen->figures += !strcmp(name, "figure");
    seen->sections += !strcmp(name, "section");
    seen->scripts += !strcmp(name, "script") || !strcmp(name, "iframe") || !strcmp(name, "link") || !strcmp(name, "img");
}

static void on_end(void *data, const char *name)
{
    Seen *seen = data;
    (void)name;
    seen->svg_depth = seen->depth == seen->svg_depth ? 0 : seen->svg_depth;
    seen->depth--;
}

static void on_text(void *data, const char *text, int length)
{
    Seen *seen = data;
    for (int i = 0; i < length && seen->length + 1 < sizeof seen->text; i++)
        seen->text[seen->length++] = text[i];
    seen->text[seen->length] = '\0';
}

static Seen *read_page(const char *path)
{
    Seen *seen = calloc(1, sizeof *seen);
    char *text = text_of(path);
    assert_int_equal(strncmp(text, "<!DOCTYPE html>", 15), 0);
    assert_null(strstr(text, "@import"));
    XML_Parser parser = XML_ParserCreate(NULL);
    XML_SetUserData(parser, seen);
    XML_SetElementHandler(parser, on_start, on_end);
    XML_SetCharacterDataHandler(parser, on_text);
    enum XML_Status status = XML_Parse(parser, text, (int)strlen(text), 1);
    if (status != XML_STATUS_OK)
        print_error("line %lu: %s\n", XML_GetCurrentLineNumber(parser), XML_ErrorString(XML_GetErrorCode(parser)));
    assert_int_equal(status, XML_STATUS_OK);
    XML_ParserFree(parser);
    free(text);
    return seen;
}

static void check_page(const Seen *seen, int figures)
{
    assert_int_equal(seen->external, 0);
    assert_int_equal(seen->scripts, 0);
    assert_int_equal(seen->unnamed_images, 0);
    assert_int_equal(seen->titled, 2 * seen->svg);   // a title and a description for each
    assert_int_equal(seen->figures, figures);
    assert_int_equal(seen->sections, 7);
    assert_true(seen->has_notice);
    assert_non_null(strstr(seen->text, "Not a medical device"));
}

static void the_page_of_a_model_is_whole(void **state)
{
    (void)state;
    char arguments[500];
    snprintf(arguments, sizeof arguments, "'%s' --report '%s'", in_folder("model.h5"), in_folder("model.html"));
    assert_int_equal(info(arguments), 0);
    char *message = text_of(in_folder("out.txt"));
    assert_non_null(strstr(message, "nodes")); // also the figures
    free(message);
    Seen *seen = read_page(in_folder("model.html"));
    check_page(seen, 2 + branch_count);
    assert_int_equal(seen->svg, 3 + branch_count + 1);
    assert_true(seen->tables >= 3);
    assert_non_null(strstr(seen->text, "C1 "));
    assert_non_null(strstr(seen->text, "S1narrow place"));
    const char *percent = strstr(seen->text, " % narrower");
    assert_true(percent && abs(atoi(percent - 2) - 50) < 5);   // of a reference of slightly uneven width
    assert_non_null(strstr(seen->text, "A1aneurysm"));
    assert_non_null(strstr(seen->text, "voxel 0.4 mm."));
    free(seen);
    char *first = text_of(in_folder("model.html"));
    assert_int_equal(info(arguments), 0);
    char *second = text_of(in_folder("model.html"));
    assert_string_equal(first, second);
    free(first);
    free(second);
}

// A tree of one node, without points or model, whose texts contain markup.
static void hostile_texts_stay_text(void **state)
{
    (void)state;
    static Faults faults;
    VesselTree *tree = vessel_tree_create(1, 0, 0);
    tree->radius[0] = 1;
    tree->direction[0] = vec3(1, 0, 0);
    tree->parent[0] = -1;
    TreeFileInfo texts = {.source = (char[]){"<script>boo()</script> & \"q\" \xff\xc3 \xed\xa0\x80 \x01 \xc3\xa9"},
                          .parameters = (char[]){"</pre><img src=http://x.invalid/>"},
                          .created_by = (char[]){"]]>"}};
    assert_true(tree_file_save(tree, &texts, in_folder("<b>&.h5"), &faults));
    char arguments[500];
    snprintf(arguments, sizeof arguments, "'%s' --report '%s'", in_folder("<b>&.h5"), in_folder("tree.html"));
    assert_int_equal(info(arguments), 0);
    Seen *seen = read_page(in_folder("tree.html"));
    check_page(seen, 1 + 1);
    assert_non_null(strstr(seen->text, "<script>boo()</script> & \"q\" "));
    assert_non_null(strstr(seen->text, "\xc3\xa9"));
    assert_non_null(strstr(seen->text, "no fitted model"));
    free(seen);
    vessel_tree_free(tree);
}

static void what_is_no_tree_gets_no_report(void **state)
{
    (void)state;
    char arguments[500];
    snprintf(arguments, sizeof arguments, "scenes/phantom/push.csv --report '%s'", in_folder("none.html"));
    assert_int_equal(info(arguments), 2);
    assert_int_equal(access(in_folder("none.html"), F_OK), -1);
    snprintf(arguments, sizeof arguments, "'%s' --report /nowhere/at/all.html", in_folder("model.h5"));
    assert_int_equal(info(arguments), 2);
}

// --- the browser ---

typedef struct Shown {
    char *dom, *log, *net;
} Shown;

static Shown show(const char *page, bool dark, const char *png)
{
    char command[2000];
    snprintf(command, sizeof command,
             "timeout 100 %s --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run --disable-background-networking "
             "--disable-component-update "
             "--disable-default-apps --disable-sync --disable-extensions --host-resolver-rules='MAP * ~NOTFOUND' --user-data-dir='%s' --enable-logging=stderr "
             "--window-size=1200,3600 %s --log-net-log='%s' --screenshot='%s' --dump-dom 'file://%s' >'%s' 2>'%s'",
             browser, in_folder("profile"), dark ? "--blink-settings=preferredColorScheme=0" : "", in_folder("net.json"), png, page, in_folder("dom.html"),
             in_folder("log.txt"));
    assert_int_equal(system(command), 0);
    return (Shown){text_of(in_folder("dom.html")), text_of(in_folder("log.txt")), text_of(in_folder("net.json"))};
}

static void shown_free(Shown *shown)
{
    free(shown->dom);
    free(shown->log);
    free(shown->net);
}

// Network requests of the page, without the browser's requests to its vendor.
static int requests(const char *net)
{
    int count = 0;
    for (const char *at = net; (at = strstr(at, "\"url\":\"http")); at++) {
        const char *host = strstr(at, "//") + 2;
        size_t length = strcspn(host, "/\"?:");
        bool makers =
            (length >= 11 && !strncmp(host + length - 11, ".google.com", 11)) || (length >= 15 && !strncmp(host + length - 15, ".googleapis.com", 15));
        count += !makers;
    }
    return count;
}

static int occurrences(const char *text, const char *what)
{
    int count = 0;
    for (const char *at = text; (at = strstr(at, what)); at++)
        count++;
    return count;
}

static long pixels_near(const char *path, int r, int g, int b)
{
    png_image png = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_file(&png, path));
    png.format = PNG_FORMAT_RGB;
    uint8_t *rgb = malloc(PNG_IMAGE_SIZE(png));
    assert_non_null(rgb);
    assert_true(png_image_finish_read(&png, NULL, rgb, 0, NULL));
    long count = 0;
    for (size_t i = 0; i < PNG_IMAGE_SIZE(png); i += 3)
        count += abs(rgb[i] - r) < 4 && abs(rgb[i + 1] - g) < 4 && abs(rgb[i + 2] - b) < 4;
    free(rgb);
    return count;
}

static void a_browser_shows_it(void **state)
{
    (void)state;
    if (!browser) {
        print_message("no chromium: what a browser makes of the report is not tested\n");
        skip();
    }
    char arguments[500];
    snprintf(arguments, sizeof arguments, "'%s' --report '%s'", in_folder("model.h5"), in_folder("shown.html"));
    assert_int_equal(info(arguments), 0);
    char *page = text_of(in_folder("shown.html"));
    Shown shown = show(in_folder("shown.html"), false, in_folder("light.png"));
    assert_int_equal(occurrences(shown.log, "CONSOLE"), 0);
    assert_int_equal(requests(shown.net), 0);
    assert_true(occurrences(page, "<svg") > 4);
    assert_int_equal(occurrences(shown.dom, "<svg"), occurrences(page, "<svg"));
    assert_int_equal(occurrences(shown.dom, "<figure id=\"figure-"), occurrences(page, "<figure id=\"figure-"));
    assert_int_equal(occurrences(shown.dom, "<polyline"), occurrences(page, "<polyline"));
    shown_free(&shown);
    // colours of the style sheet: bars of class C1, the lines of orders 1 and 2, the narrow place, the sac's ring, mostly white
    assert_true(pixels_near(in_folder("light.png"), 0x00, 0x72, 0x5a) > 2000);
    assert_true(pixels_near(in_folder("light.png"), 0x0b, 0x5f, 0xa5) > 300);
    assert_true(pixels_near(in_folder("light.png"), 0xa8, 0x48, 0x0a) > 300);
    assert_true(pixels_near(in_folder("light.png"), 0xb3, 0x00, 0x1b) > 300);
    assert_true(pixels_near(in_folder("light.png"), 0x7a, 0x2b, 0xa0) > 100);
    assert_true(pixels_near(in_folder("light.png"), 255, 255, 255) > 1000000);
    shown = show(in_folder("shown.html"), true, in_folder("dark.png"));
    assert_int_equal(occurrences(shown.log, "CONSOLE"), 0);
    assert_true(pixels_near(in_folder("dark.png"), 0x14, 0x17, 0x1a) > 1000000);
    assert_true(pixels_near(in_folder("dark.png"), 0x6f, 0xb8, 0xf5) > 300);
    shown_free(&shown);
    // the check can fail: without the page's policy a picture is requested and a script reports an error
    char *policy = strstr(page, "<meta http-equiv"), *end = policy ? strstr(policy, "/>") : NULL, *body = strstr(page, "<body>");
    assert_true(end && body);
    memset(policy, ' ', (size_t)(end + 2 - policy));
    char *worse = malloc(strlen(page) + 200);
    sprintf(worse, "%.*s<body><img src=\"http://seldinger.invalid/x.png\"/><script>boo()</script>%s", (int)(body - page), page, body + 6);
    put("worse.html", worse);
    shown = show(in_folder("worse.html"), false, in_folder("worse.png"));
    assert_true(occurrences(shown.log, "CONSOLE") > 0);
    assert_true(requests(shown.net) > 0);
    shown_free(&shown);
    free(worse);
    free(page);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_page_of_a_model_is_whole),
        cmocka_unit_test(hostile_texts_stay_text),
        cmocka_unit_test(what_is_no_tree_gets_no_report),
        cmocka_unit_test(a_browser_shows_it),
    };
    return cmocka_run_group_tests_name("report", tests, set_up, remove_folder);
}
