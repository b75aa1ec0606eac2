// The sessions of a folder: by date, with the reason for each file that cannot be read; and their table as CSV, whose numbers are those of the JSON files.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/base.h"
#include "sim/score_json.h"
#include "sim/sim.h"

#include <string.h>

static char folder[] = "/tmp/seldinger-archive-XXXXXX";
#include "tests/folder.h"

static const char scene_text[] =
    "seldinger: 1\nvessel: {shape: {name: capsule}}\nwire: {sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
    "sheath: {inlet: root}\ntargets: [{name: end, point_mm: [0, 0, 2], radius_mm: 1}]\n"
    "exercise: {title: 'Reach, \"the\" end', instructions: Push., target: end}\n";
static const char odd_name[] = "O'Hara, \"Ada\" <b>\xc3\xa9</b>";

// Figures that need up to 17 digits, different in each session.
static char *session_text(const char *trainee, const char *date, double seed)
{
    static Session session;
    static Faults faults;
    Scene *scene = scene_parse(scene_text, strlen(scene_text), "a.yaml", &faults);
    assert_non_null(scene);
    session_begin(&session, scene, trainee, "keyboard", date);
    scene_free(scene);
    ScoreFigures *f = &session.figures;
    f->points = 100 * seed / 3;
    f->time_s = 0.1 + 0.2 * seed;
    f->contrast_ml = 1e-7 * seed;
    f->pulses = (int64_t)(1000 * seed);
    f->error[ERROR_KICK].count = f->error_total = 2;
    f->judged[PART_TIME] = (ScorePartFigures){.measured = 3, .par = 2, .most = 50, .points = 10 * seed / 7};
    memset(session.series_sha256, '0', 64);
    snprintf(session.recording_path, sizeof session.recording_path, "r.h5");
    char *text = session_json(&session);
    assert_non_null(text);
    return text;
}

static void put_session(const char *name, const char *trainee, const char *date, double seed)
{
    char *text = session_text(trainee, date, seed);
    put(name, text);
    free(text);
}

static int fill_folder(void **state)
{
    if (make_folder(state) != 0)
        return -1;
    put_session("c.json", odd_name, "2026-11-26T10:00:00Z", 1.1);
    put_session("a.json", odd_name, "2026-11-28T10:00:00Z", 2.3);
    put_session("b.json", "Bob", "2026-11-27T10:00:00Z", 0.7);
    char *text = session_text("Bob", "2026-11-27T10:00:00Z", 1);
    put_bytes("cut.json", text, strlen(text) / 2);
    memcpy(strstr(text, "\"seldinger_session\":\t1") + strlen("\"seldinger_session\":\t"), "7", 1);
    put("other-format.json", text);
    free(text);
    put("empty.json", "");
    put("summary.json", "{\"steps\": 3}");
    put("notes.txt", "no session");
    return 0;
}

static const char *why(const SessionArchive *archive, const char *file)
{
    for (int i = 0; i < archive->gap_count; i++)
        if (!strcmp(archive->gap[i].file, file))
            return archive->gap[i].why;
    fail_msg("%s is not listed", file);
    return "";
}

static void each_file_is_a_session_or_listed(void **state)
{
    (void)state;
    static Faults faults;
    SessionArchive archive;
    assert_true(session_archive_read(&archive, folder, &faults));
    assert_int_equal(archive.count, 3);
    assert_string_equal(archive.entry[0].file, "c.json");
    assert_string_equal(archive.entry[1].session.trainee, "Bob");
    assert_string_equal(archive.entry[2].file, "a.json");
    assert_int_equal(archive.gap_count, 4);
    assert_non_null(strstr(why(&archive, "cut.json"), "is not JSON"));
    assert_non_null(strstr(why(&archive, "other-format.json"), "is 7; expected 1 to 1"));
    assert_string_equal(why(&archive, "empty.json"), "is empty");
    assert_non_null(strstr(why(&archive, "summary.json"), "no key 'seldinger_session'"));
    for (int i = 0; i < archive.gap_count; i++)
        assert_null(strstr(archive.gap[i].why, folder));     // the reason alone
    session_archive_free(&archive);
    assert_false(session_archive_read(&archive, in_folder("nosuch"), &faults));
    assert_non_null(strstr(faults.text[0], "expected a folder of sessions"));
    session_archive_free(&archive);
}

// Takes one field of a CSV text; returns where the next begins. *is_last: it ended its row.
static const char *take_field(const char *at, char *field, size_t capacity, bool *is_last)
{
    size_t used = 0;
    bool quoted = *at == '"';
    at += quoted;
    for (; *at && used + 1 < capacity; at++) {
        if (quoted && at[0] == '"' && at[1] == '"')
            at++;
        else if (quoted ? *at == '"' : *at == ',' || *at == '\r')
            break;
        field[used++] = *at;
    }
    field[used] = 0;
    at += quoted;
    *is_last = *at == '\r';
    assert_true(*at == ',' || (at[0] == '\r' && at[1] == '\n'));
    return at + (*is_last ? 2 : 1);
}

enum { COLUMNS = 80, ROWS = 12, FIELD = 400 };
typedef struct Table {
    int columns, rows;
    char cell[ROWS][COLUMNS][FIELD];
} Table;

static const Table *csv_table(const SessionArchive *archive, const char *trainee)
{
    static Table table;
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    assert_non_null(out);
    session_archive_print_csv(archive, trainee, out);
    assert_int_equal(fclose(out), 0);
    table = (Table){0};
    for (const char *at = text; *at; table.rows++) {
        int column = 0;
        assert_true(table.rows < ROWS);
        for (bool is_last = false; !is_last; column++) {
            assert_true(column < COLUMNS);
            at = take_field(at, table.cell[table.rows][column], FIELD, &is_last);
        }
        assert_true(table.rows == 0 || column == table.columns);
        table.columns = column;
    }
    free(text);
    return &table;
}

static const char *cell(const Table *table, int row, const char *name)
{
    for (int i = 0; i < table->columns; i++)
        if (!strcmp(table->cell[0][i], name))
            return table->cell[row][i];
    fail_msg("no column %s", name);
    return "";
}

static void the_table_holds_the_numbers_of_the_files(void **state)
{
    (void)state;
    static Faults faults;
    SessionArchive archive;
    assert_true(session_archive_read(&archive, folder, &faults));
    const Table *table = csv_table(&archive, NULL);
    assert_int_equal(table->rows, 1 + 3 + 4);
    for (int row = 1; row <= 3; row++) {
        const ArchivedSession *entry = &archive.entry[row - 1];
        assert_string_equal(cell(table, row, "file"), entry->file);
        assert_string_equal(cell(table, row, "trainee"), entry->session.trainee);
        assert_string_equal(cell(table, row, "title"), "Reach, \"the\" end");
        assert_string_equal(cell(table, row, "why_unreadable"), "");
        char *path = text_file_in(folder, entry->file), *text = text_of(path);
        free(path);
        cJSON *root = cJSON_Parse(text), *score = cJSON_GetObjectItem(root, "score");
        int compared = 0;
        for (const cJSON *item = score->child; item; item = item->next)
            if (cJSON_IsNumber(item)) {
                assert_true(strtod(cell(table, row, item->string), NULL) == item->valuedouble);
                compared++;
            }
        assert_true(compared > 20);
        cJSON *kick = cJSON_GetObjectItem(cJSON_GetObjectItem(score, "errors"), "kick");
        assert_true(strtod(cell(table, row, "errors_kick"), NULL) == cJSON_GetObjectItem(kick, "count")->valuedouble);
        cJSON *time = cJSON_GetObjectItem(cJSON_GetObjectItem(score, "points_of"), "time");
        assert_true(strtod(cell(table, row, "points_time"), NULL) == cJSON_GetObjectItem(time, "points")->valuedouble);
        assert_string_equal(cell(table, row, "points_contrast"), "");        // not judged
        cJSON_Delete(root);
        free(text);
    }
    for (int i = 0; i < archive.gap_count; i++) {
        assert_string_equal(cell(table, 4 + i, "file"), archive.gap[i].file);
        assert_string_equal(cell(table, 4 + i, "why_unreadable"), archive.gap[i].why);
        assert_string_equal(cell(table, 4 + i, "points"), "");
    }
    table = csv_table(&archive, odd_name);
    assert_int_equal(table->rows, 1 + 2 + 4);
    assert_string_equal(cell(table, 2, "trainee"), odd_name);
    session_archive_free(&archive);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_file_is_a_session_or_listed), cmocka_unit_test(the_table_holds_the_numbers_of_the_files)};
    return cmocka_run_group_tests(tests, fill_folder, remove_folder);
}
