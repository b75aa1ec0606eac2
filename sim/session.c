#include "sim/session.h"

#include "base/base.h"
#include "sim/score_json.h"

#include <dirent.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const session_mode[] = {"practice", "examination", NULL};

// Copies at most `capacity` - 1 bytes, ending with a whole character.
static void copy_text(char *to, size_t capacity, const char *from)
{
    size_t length = strlen(from);
    if (length >= capacity) {
        length = capacity - 1;
        while (length > 0 && ((unsigned char)from[length] & 0xc0) == 0x80)
            length--;
    }
    memcpy(to, from, length);
    to[length] = 0;
}

// YYYY-MM-DDThh:mm:ssZ, so that dates sort as text.
bool session_is_date(const char *text)
{
    static const char form[] = "0000-00-00T00:00:00Z";
    for (size_t i = 0; i < sizeof form; i++)
        if (form[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != form[i])
            return false;
    return true;
}

void session_date(time_t when, char text[SESSION_DATE])
{
    struct tm utc = {0};
    gmtime_r(&when, &utc);
    strftime(text, SESSION_DATE, "%Y-%m-%dT%H:%M:%SZ", &utc);
}

void session_begin(Session *session, const Scene *scene, const char *trainee, const char *device, const char *date)
{
    Sha256 sha;
    *session = (Session){.step_ms = scene->dt};
    copy_text(session->trainee, sizeof session->trainee, trainee);
    copy_text(session->device, sizeof session->device, device);
    copy_text(session->version, sizeof session->version, "seldinger " SELDINGER_VERSION);
    copy_text(session->scene_path, sizeof session->scene_path, scene->path);
    copy_text(session->date, sizeof session->date, date);
    sha256_begin(&sha);
    sha256_add(&sha, scene->text, strlen(scene->text));
    sha256_end(&sha, session->scene_sha256);
    if (!scene->exercise)
        return;
    copy_text(session->title, sizeof session->title, scene->exercise->title);
    copy_text(session->target, sizeof session->target, scene->target[scene->exercise->target].name);
}

void session_set_score(Session *session, const Score *score)
{
    const ScoreEvent *event = score_events(score, &session->event_count);
    session->figures = score_figures(score);
    memcpy(session->event, event, (size_t)session->event_count * sizeof *event);
}

// Controls that were added later enter the digest only if one of them was used, so digests of older sessions stay valid.
static void digest_xray(Sha256 *sha, const RecordedRun *run)
{
    int values = XRAY_VALUES_BEFORE_TOOLS;
    for (int64_t i = 0; i < run->step_count; i++) {
        float value[XRAY_VALUES];
        memcpy(value, &run->xray[i], sizeof value);
        for (int k = values; k < XRAY_VALUES; k++)
            values = value[k] != 0 ? k + 1 : values;
    }
    for (int64_t i = 0; i < run->step_count; i++)
        sha256_add(sha, &run->xray[i], (size_t)values * sizeof(float));
}

static void digest(const RecordedRun *run, char hex[65])
{
    Sha256 sha;
    size_t steps = (size_t)run->step_count;
    sha256_begin(&sha);
    sha256_add(&sha, run->time_s, steps * sizeof *run->time_s);
    for (int k = 0; k < run->tool_count; k++) {
        sha256_add(&sha, run->tool[k].command, 2 * steps * sizeof *run->command);
        if (run->tool[k].released)
            sha256_add(&sha, run->tool[k].released, steps);
    }
    if (run->exchange)
        sha256_add(&sha, run->exchange, 2 * (size_t)run->tool_count * steps);
    if (run->xray)
        digest_xray(&sha, run);
    sha256_add(&sha, run->state_hash, steps * sizeof *run->state_hash);
    sha256_end(&sha, hex);
}

void session_set_run(Session *session, const RecordedRun *run, const char *path)
{
    copy_text(session->recording_path, sizeof session->recording_path, path);
    session->steps = run->step_count;
    session->step_ms = run->step_ms;
    session->state_hash = run->step_count > 0 ? run->state_hash[run->step_count - 1] : 0;
    session->is_examination = run->xray && run->step_count > 0;
    for (int64_t i = 0; run->xray && i < run->step_count; i++)
        session->is_examination &= ((int)run->xray[i].seen & SEEN_EXAMINATION) != 0;
    digest(run, session->series_sha256);
}

bool session_is_of(const Session *session, const RecordedRun *run)
{
    char hex[65];
    digest(run, hex);
    return !strcmp(hex, session->series_sha256);
}

// --- JSON ---

static bool add_text(cJSON *to, const char *name, const char *text) { return cJSON_AddStringToObject(to, name, text) != NULL; }
static bool add_number(cJSON *to, const char *name, double value) { return cJSON_AddNumberToObject(to, name, value) != NULL; }

static bool add_scene(cJSON *root, const Session *s)
{
    cJSON *scene = cJSON_AddObjectToObject(root, "scene");
    return scene && add_text(scene, "path", s->scene_path) && add_text(scene, "sha256", s->scene_sha256) && add_text(scene, "title", s->title) &&
           add_text(scene, "target", s->target);
}

static bool add_recording(cJSON *root, const Session *s)
{
    char hash[17];
    snprintf(hash, sizeof hash, "%016" PRIx64, s->state_hash);
    cJSON *recording = cJSON_AddObjectToObject(root, "recording");
    return recording && add_text(recording, "path", s->recording_path) && add_number(recording, "steps", (double)s->steps) &&
           add_number(recording, "step_ms", s->step_ms) && add_text(recording, "series_sha256", s->series_sha256) && add_text(recording, "state_hash", hash);
}

static bool add_events(cJSON *root, const Session *s)
{
    cJSON *list = cJSON_AddArrayToObject(root, "events");
    for (int i = 0; list && i < s->event_count; i++) {
        cJSON *event = cJSON_CreateObject();
        if (!event || !cJSON_AddItemToArray(list, event) || !add_text(event, "kind", score_error_name[s->event[i].kind]) ||
            !add_number(event, "time_s", s->event[i].time_s) ||
            (s->figures.tool_count > 1 && s->event[i].tool >= 0 && !add_text(event, "tool", s->figures.tool[s->event[i].tool].name)))
            return false;
    }
    return list != NULL;
}

char *session_json(const Session *s)
{
    cJSON *root = cJSON_CreateObject();
    bool good = root && add_number(root, "seldinger_session", 1) && add_text(root, "trainee", s->trainee) && add_text(root, "date", s->date) &&
                add_text(root, "device", s->device) && add_text(root, "version", s->version) && add_text(root, "mode", session_mode[s->is_examination]) &&
                add_scene(root, s) && add_recording(root, s);
    cJSON *score = good ? cJSON_AddObjectToObject(root, "score") : NULL;
    char *text = score && score_add_json(score, &s->figures) && add_events(root, s) ? cJSON_Print(root) : NULL;
    cJSON_Delete(root);
    return text;
}

// Sessions of older versions were practice.
static bool read_is_examination(const JsonReading *reading, const cJSON *root)
{
    return cJSON_GetObjectItemCaseSensitive(root, "mode") && json_choice(reading, root, "session", "mode", session_mode) == 1;
}

static bool is_hex(const char *text, size_t digits) { return strlen(text) == digits && strspn(text, "0123456789abcdef") == digits; }

static void read_hex(const JsonReading *reading, const cJSON *object, const char *where, const char *key, size_t digits, bool is_optional, char *text)
{
    json_text(reading, object, where, key, digits + 1, text);
    if (!is_hex(text, digits) && !(is_optional && !*text))
        faults_add(reading->faults, reading->file, 0, 0, "'%s.%s' is not a string of %zu lower-case hexadecimal digits", where, key, digits);
}

static void read_recording(const JsonReading *reading, const cJSON *object, Session *s)
{
    static const char *const keys[] = {"path", "steps", "step_ms", "series_sha256", "state_hash", NULL};
    char hash[17];
    if (!json_keys(reading, object, "recording", keys))
        return;
    json_text(reading, object, "recording", "path", sizeof s->recording_path, s->recording_path);
    s->steps = json_count(reading, object, "recording", "steps", INT64_C(1) << 50);
    s->step_ms = json_number(reading, object, "recording", "step_ms", 1e-3, 100);
    read_hex(reading, object, "recording", "series_sha256", 64, true, s->series_sha256);
    read_hex(reading, object, "recording", "state_hash", 16, false, hash);
    s->state_hash = strtoull(hash, NULL, 16);
}

// With several tools, the tool of an error is written if the error belongs to a single one.
static int read_event_tool(const JsonReading *reading, const cJSON *event, const ScoreFigures *f)
{
    const char *names[TOOLS_MOST + 1] = {0};
    for (int k = 0; k < f->tool_count; k++)
        names[k] = f->tool[k].name;
    bool has_tool = cJSON_GetObjectItemCaseSensitive(event, "tool") != NULL;
    return has_tool && names[0] ? json_choice(reading, event, "events", "tool", names) : -1;
}

static void read_events(const JsonReading *reading, const cJSON *list, Session *s)
{
    static const char *const keys[] = {"kind", "time_s", "tool", NULL};
    int count = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : -1;
    if (count < 0 || count > SCORE_EVENTS_MOST) {
        faults_add(reading->faults, reading->file, 0, 0, "'events' is not a list of at most %d entries", SCORE_EVENTS_MOST);
        return;
    }
    for (const cJSON *event = list->child; event; event = event->next) {
        if (!json_keys(reading, event, "events", keys))
            continue;
        int kind = json_choice(reading, event, "events", "kind", score_error_name);
        int tool = read_event_tool(reading, event, &s->figures);
        s->event[s->event_count++] = (ScoreEvent){(ScoreError)kind, tool, json_number(reading, event, "events", "time_s", 0, 1e7)};
    }
}

static void read_session(const JsonReading *reading, const cJSON *root, Session *s)
{
    static const char *const keys[] = {"seldinger_session", "trainee", "date", "device", "version", "mode", "scene", "recording", "score", "events", NULL};
    static const char *const scene_keys[] = {"path", "sha256", "title", "target", NULL};
    if (!json_keys(reading, root, "session", keys))
        return;
    json_number(reading, root, "session", "seldinger_session", 1, 1);
    json_text(reading, root, "session", "trainee", sizeof s->trainee, s->trainee);
    json_text(reading, root, "session", "device", sizeof s->device, s->device);
    json_text(reading, root, "session", "version", sizeof s->version, s->version);
    s->is_examination = read_is_examination(reading, root);
    json_text(reading, root, "session", "date", sizeof s->date, s->date);
    if (!session_is_date(s->date))
        faults_add(reading->faults, reading->file, 0, 0, "'date' is '%.24s'; expected the form 2025-11-21T22:05:00Z", s->date);
    const cJSON *scene = cJSON_GetObjectItemCaseSensitive(root, "scene");
    if (json_keys(reading, scene, "scene", scene_keys)) {
        json_text(reading, scene, "scene", "path", sizeof s->scene_path, s->scene_path);
        read_hex(reading, scene, "scene", "sha256", 64, false, s->scene_sha256);
        json_text(reading, scene, "scene", "title", sizeof s->title, s->title);
        json_text(reading, scene, "scene", "target", sizeof s->target, s->target);
    }
    read_recording(reading, cJSON_GetObjectItemCaseSensitive(root, "recording"), s);
    score_read_json(reading, cJSON_GetObjectItemCaseSensitive(root, "score"), &s->figures);
    read_events(reading, cJSON_GetObjectItemCaseSensitive(root, "events"), s);
}

bool session_parse(const char *text, size_t length, const char *path, Session *session, Faults *faults)
{
    const char *end = NULL;
    int before = faults->count;
    if (length > SESSION_BYTES_MOST) {
        faults_add(faults, path, 0, 0, "is %zu bytes long; expected at most %d", length, SESSION_BYTES_MOST);
        return false;
    }
    cJSON *root = cJSON_ParseWithLengthOpts(text, length, &end, false);
    for (size_t i = root ? (size_t)(end - text) : length; i < length && faults->count == before; i++)
        if (!strchr(" \t\r\n", text[i]) || !text[i])
            faults_add_at_byte(faults, path, i, "unexpected text after the session");
    if (!root)
        faults_add_at_byte(faults, path, end ? (size_t)(end - text) : 0, "is not JSON");
    Session *read = root && faults->count == before ? calloc(1, sizeof *read) : NULL;
    if (read)
        read_session(&(JsonReading){path, faults}, root, read);
    else if (faults->count == before)
        faults_add(faults, path, 0, 0, "not enough memory");
    bool good = faults->count == before;
    if (good)
        *session = *read;
    free(read);
    cJSON_Delete(root);
    return good;
}

bool session_load(const char *path, Session *session, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    bool good = text && session_parse(text, length, path, session, faults);
    free(text);
    return good;
}

// --- sessions of a folder ---

static int by_date(const void *a, const void *b)
{
    const Session *x = a, *y = b;
    int order = strcmp(x->date, y->date);
    return order ? order : strcmp(x->recording_path, y->recording_path);
}

static int by_name(const struct dirent **a, const struct dirent **b) { return strcmp((*a)->d_name, (*b)->d_name); }

static int is_json(const struct dirent *entry)
{
    size_t length = strlen(entry->d_name);
    return length > 5 && !strcmp(entry->d_name + length - 5, ".json");
}

// Other JSON files (a run's summary) are ignored; one that claims to be a session but cannot be read is broken.
static bool is_session_text(const char *text) { return strstr(text, "\"seldinger_session\"") != NULL; }

Session *session_list(const char *folder, const char *trainee, const char *title, int *count, int *broken, Faults *faults)
{
    struct dirent **entry = NULL;
    int found = scandir(folder, &entry, is_json, by_name);
    *count = *broken = 0;
    Session *list = found >= 0 ? calloc((size_t)found + 1, sizeof *list) : NULL;
    Faults *own = calloc(1, sizeof *own);
    for (int i = 0; i < found; i++) {
        size_t length, capacity = strlen(folder) + strlen(entry[i]->d_name) + 2;
        char *path = malloc(capacity), *text = NULL;
        if (path && list && own) {
            snprintf(path, capacity, "%s/%s", folder, entry[i]->d_name);
            faults_clear(own);
            text = text_file_read(path, &length, own);
            Session *at = &list[*count];
            if (text && session_parse(text, length, path, at, own))
                *count += !strcmp(at->trainee, trainee) && !strcmp(at->title, title);
            else
                *broken += !text || is_session_text(text);
        } else {
            ++*broken;
        }
        free(text);
        free(path);
        free(entry[i]);
    }
    free(entry);
    free(own);
    if (!list)
        faults_add(faults, folder, 0, 0, found < 0 ? "is not a readable folder" : "not enough memory");
    else
        qsort(list, (size_t)*count, sizeof *list, by_date);
    return list;
}
