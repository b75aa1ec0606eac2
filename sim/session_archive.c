#include "sim/session_archive.h"

#include "base/base.h"
#include "sim/score_json.h"
#include "sim/session_files.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

static int by_date(const void *a, const void *b)
{
    const ArchivedSession *x = a, *y = b;
    int order = strcmp(x->session.date, y->session.date);
    return order ? order : strcmp(x->file, y->file);
}

static int by_name(const void *a, const void *b) { return strcmp(((const ArchiveGap *)a)->file, ((const ArchiveGap *)b)->file); }

static int is_json(const struct dirent *entry)
{
    size_t length = strlen(entry->d_name);
    return length > 5 && !strcmp(entry->d_name + length - 5, ".json");
}

static void add_gap(SessionArchive *archive, const char *file, const char *why)
{
    ArchiveGap *gap = &archive->gap[archive->gap_count++];
    snprintf(gap->file, sizeof gap->file, "%s", file);
    snprintf(gap->why, sizeof gap->why, "%s", why);
}

// The first fault without the path before it, and how many more there are.
static void add_faulty(SessionArchive *archive, const char *file, const char *path, const Faults *faults)
{
    char why[FAULT_LENGTH];
    size_t length = strlen(path);
    const char *text = faults->count > 0 ? faults->text[0] : "";
    text += strncmp(text, path, length) ? 0 : length;
    text += strspn(text, ": ");
    if (faults->count > 1)
        snprintf(why, sizeof why, "%.440s (and %d more)", text, faults->count - 1);
    else
        snprintf(why, sizeof why, "%.500s", text);
    add_gap(archive, file, why);
}

static bool read_file(SessionArchive *archive, const char *folder, const char *file, Faults *own)
{
    size_t length = 0;
    char *path = text_file_in(folder, file);
    faults_clear(own);
    char *text = path ? text_file_read(path, &length, own) : NULL;
    ArchivedSession *at = &archive->entry[archive->count];
    if (text && !strstr(text, "\"seldinger_session\"")) {
        add_gap(archive, file, length == 0 ? "is empty" : "is not a session: it has no key 'seldinger_session'");
    } else if (text && session_parse(text, length, path, &at->session, own)) {
        snprintf(at->file, sizeof at->file, "%s", file);
        archive->count++;
    } else if (path) {
        add_faulty(archive, file, path, own);
    }
    free(text);
    bool good = path != NULL;
    free(path);
    return good;
}

static void read_cut_off(SessionArchive *archive, const CutOff *cut_off)
{
    for (int i = 0; i < cut_off->count; i++) {
        const char *slash = strrchr(cut_off->path[i], '/');
        add_gap(archive, slash ? slash + 1 : cut_off->path[i],
                "is the recording of an interrupted session without a session file; `seldinger report` with this file makes it");
    }
}

bool session_archive_read(SessionArchive *archive, const char *folder, Faults *faults)
{
    struct dirent **entry = NULL;
    *archive = (SessionArchive){0};
    int found = scandir(folder, &entry, is_json, alphasort);
    if (found < 0) {
        faults_add(faults, folder, 0, 0, "cannot be read: %s; expected a folder of sessions", strerror(errno));
        return false;
    }
    CutOff cut_off = session_find_cut_off(folder);
    Faults *own = calloc(1, sizeof *own);
    archive->entry = calloc((size_t)found + 1, sizeof *archive->entry);
    archive->gap = calloc((size_t)found + (size_t)cut_off.count + 1, sizeof *archive->gap);
    bool good = own && archive->entry && archive->gap;
    for (int i = 0; i < found; i++) {
        good = good && read_file(archive, folder, entry[i]->d_name, own);
        free(entry[i]);
    }
    free(entry);
    free(own);
    if (good) {
        read_cut_off(archive, &cut_off);
        qsort(archive->entry, (size_t)archive->count, sizeof *archive->entry, by_date);
        qsort(archive->gap, (size_t)archive->gap_count, sizeof *archive->gap, by_name);
    } else {
        faults_add(faults, folder, 0, 0, "not enough memory for its sessions");
    }
    session_free_cut_off(&cut_off);
    return good;
}

void session_archive_free(SessionArchive *archive)
{
    free(archive->entry);
    free(archive->gap);
    *archive = (SessionArchive){0};
}

// --- CSV ---

enum { TEXTS = 9 };

static void print_text(FILE *out, const char *text)
{
    fputc('"', out);
    for (; *text; text++) {
        if (*text == '"')
            fputc('"', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

// With the digits of the JSON file: 15, and 17 if they are needed to tell the number from its neighbours.
static void print_number(FILE *out, double value)
{
    char text[32];
    snprintf(text, sizeof text, "%1.15g", value);
    if (strtod(text, NULL) != value)
        snprintf(text, sizeof text, "%1.17g", value);
    fprintf(out, ",%s", text);
}

static int print_names(FILE *out)
{
    int columns = TEXTS;
    fprintf(out, "file,trainee,date,title,target,mode,device,version,state");
    for (int i = 0; score_figure_name(i); i++, columns++)
        fprintf(out, ",%s", score_figure_name(i));
    fprintf(out, ",pulses,error_total");
    for (int i = 0; i < PART_COUNT; i++)
        fprintf(out, ",points_%s", score_part_name[i]);
    for (int i = 0; i < ERROR_COUNT; i++)
        fprintf(out, ",errors_%s", score_error_name[i]);
    fprintf(out, ",why_unreadable\r\n");
    return columns + 2 + PART_COUNT + ERROR_COUNT + 1;
}

static void print_session(FILE *out, const ArchivedSession *entry)
{
    const Session *s = &entry->session;
    const ScoreFigures *f = &s->figures;
    const char *const text[TEXTS] = {entry->file, s->trainee, s->date,
                                     s->title,    s->target,  s->is_examination ? "examination" : "practice",
                                     s->device,   s->version, score_state_name[f->state]};
    for (int i = 0; i < TEXTS; i++) {
        fputs(i > 0 ? "," : "", out);
        print_text(out, text[i]);
    }
    for (int i = 0; score_figure_name(i); i++)
        print_number(out, score_figure(f, i));
    print_number(out, (double)f->pulses);
    print_number(out, f->error_total);
    for (int i = 0; i < PART_COUNT; i++)
        if (f->judged[i].most > 0)
            print_number(out, f->judged[i].points);
        else
            fputc(',', out);
    for (int i = 0; i < ERROR_COUNT; i++)
        print_number(out, f->error[i].count);
    fprintf(out, ",\r\n");
}

void session_archive_print_csv(const SessionArchive *archive, const char *trainee, FILE *out)
{
    const int columns = print_names(out);
    for (int i = 0; i < archive->count; i++)
        if (!trainee || !strcmp(trainee, archive->entry[i].session.trainee))
            print_session(out, &archive->entry[i]);
    for (int i = 0; i < archive->gap_count; i++) {
        print_text(out, archive->gap[i].file);
        for (int k = 1; k < columns; k++)
            fputc(',', out);
        print_text(out, archive->gap[i].why);
        fprintf(out, "\r\n");
    }
}
