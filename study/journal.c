#include "study/journal.h"

#include "sim/sim.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CHECKSUM = 16 };
static const double sync_s = 1;

struct Journal {
    int file, lock;
    char path[PATH_MAX];
    FILE *reader;
    int64_t end;             // of the last whole line
    double synced_s;
    int64_t runs;
};

static void checksum(const char *text, size_t length, char hex[65])
{
    Sha256 sha;
    sha256_begin(&sha);
    sha256_add(&sha, text, length);
    sha256_end(&sha, hex);
}

// Cuts the checksum and the line break off a line. False if it is damaged.
static bool is_sound(char *line, size_t length)
{
    char hex[65];
    if (length < CHECKSUM + 2 || line[length - 1] != '\n' || line[length - CHECKSUM - 2] != '\t')
        return false;
    length -= CHECKSUM + 2;
    checksum(line, length, hex);
    bool good = !strncmp(line + length + 1, hex, CHECKSUM);
    line[length] = 0;
    return good;
}

// A lock of the whole folder, which ends with the process.
static bool take_lock(Journal *journal, const char *folder, Faults *faults)
{
    char path[PATH_MAX], who[80] = "";
    struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    snprintf(path, sizeof path, "%.4000s/lock", folder);
    journal->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (journal->lock < 0) {
        faults_add(faults, folder, 0, 0, "cannot be written to: %s; expected a folder for the results", strerror(errno));
        return false;
    }
    if (fcntl(journal->lock, F_SETLK, &lock) != 0) {
        ssize_t length = pread(journal->lock, who, sizeof who - 1, 0);
        who[length > 0 ? length : 0] = 0;
        faults_add(faults, folder, 0, 0, "another sweep is writing to it (process %.*s); wait for its end, or take another folder", (int)strcspn(who, "\n"),
                   *who ? who : "unknown");
        return false;
    }
    int length = snprintf(who, sizeof who, "%ld\n", (long)getpid());
    if (ftruncate(journal->lock, 0) != 0 || pwrite(journal->lock, who, (size_t)length, 0) != length)
        return true;         // the number is only for messages
    return true;
}

static bool append(Journal *journal, const char *text, Faults *faults)
{
    char hex[65], *line = NULL;
    size_t length, written = 0;
    FILE *stream = open_memstream(&line, &length);
    checksum(text, strlen(text), hex);
    if (stream)
        fprintf(stream, "%s\t%.*s\n", text, CHECKSUM, hex);
    if (!stream || fclose(stream) != 0)
        heap_is_empty(strlen(text), __FILE__);
    for (ssize_t n; written < length; written += (size_t)n)
        if ((n = pwrite(journal->file, line + written, length - written, journal->end + (int64_t)written)) <= 0) {
            if (n < 0 && errno == EINTR) {
                n = 0;
                continue;
            }
            faults_add(faults, journal->path, 0, 0, "cannot be written: %s; the results before are kept, and the same command goes on", strerror(errno));
            if (ftruncate(journal->file, journal->end) != 0)
                faults_add(faults, journal->path, 0, 0, "cannot be cut to its last whole line: %s", strerror(errno));
            free(line);
            return false;
        }
    journal->end += (int64_t)length;
    free(line);
    double now = clock_s(CLOCK_MONOTONIC);
    if (now - journal->synced_s > sync_s) {
        fdatasync(journal->file);
        journal->synced_s = now;
    }
    return true;
}

bool journal_add(Journal *journal, const char *text, Faults *faults)
{
    SEL_ASSERT(!strchr(text, '\n'), "a result is one line");
    return append(journal, text, faults);
}

// Reads from `offset` to the end; sets `end` behind the last whole line.
static int64_t read_lines(Journal *journal, int64_t offset, JournalReader *each, void *context)
{
    char *line = NULL;
    size_t capacity = 0;
    int64_t damaged = 0;
    fseeko(journal->reader, (off_t)offset, SEEK_SET);
    clearerr(journal->reader);
    journal->end = offset;
    for (ssize_t length; (length = getline(&line, &capacity, journal->reader)) > 0 && line[length - 1] == '\n'; journal->end += length) {
        int64_t run = -1;
        if (is_sound(line, (size_t)length) && !strncmp(line, "{\"run\":", 7))
            run = strtoll(line + 7, NULL, 10);
        if (run < 0 || run >= journal->runs)
            damaged++;
        else if (each)
            each(context, run, line, journal->end);
    }
    free(line);
    return damaged;
}

static int64_t heading_length(Journal *journal, cJSON **heading)
{
    char *line = NULL;
    size_t capacity = 0;
    rewind(journal->reader);
    ssize_t length = getline(&line, &capacity, journal->reader);
    *heading = length > 0 && is_sound(line, (size_t)length) ? cJSON_Parse(line) : NULL;
    free(line);
    return length > 0 ? length : 0;
}

int64_t journal_read(Journal *journal, JournalReader *each, void *context)
{
    cJSON *heading;
    int64_t begin = heading_length(journal, &heading);
    cJSON_Delete(heading);
    return read_lines(journal, begin, each, context);
}

char *journal_at(Journal *journal, int64_t offset)
{
    char *line = NULL;
    size_t capacity = 0;
    fseeko(journal->reader, (off_t)offset, SEEK_SET);
    ssize_t length = getline(&line, &capacity, journal->reader);
    if (length > 0 && is_sound(line, (size_t)length))
        return line;
    free(line);
    return NULL;
}

// Names the first thing in which two headings differ.
static bool is_same(const Journal *journal, const cJSON *was, const cJSON *is, Faults *faults)
{
    static const char advice[] = "its results would be mixed with others; take a new folder, or remove this one";
    for (const cJSON *item = is->child; item; item = item->next) {
        const cJSON *other = cJSON_GetObjectItemCaseSensitive(was, item->string);
        if (cJSON_Compare(item, other, true))
            continue;
        const cJSON *entry = item->child;
        while (entry && cJSON_Compare(entry, cJSON_GetObjectItemCaseSensitive(other, entry->string), true))
            entry = entry->next;
        if (cJSON_IsObject(item))
            faults_add(faults, journal->path, 0, 0, "the file %.200s has changed since the sweep began: %s", entry ? entry->string : "of a scene", advice);
        else
            faults_add(faults, journal->path, 0, 0, "the %s was %.70s when the sweep began and is %.70s now: %s", item->string,
                       cJSON_IsString(other) ? other->valuestring : "another", cJSON_IsString(item) ? item->valuestring : "another", advice);
        return false;
    }
    return true;
}

// Cuts the file. What the reader holds of it would be read again after a seek, so it begins anew.
static bool cut(Journal *journal, int64_t length)
{
    journal->end = length;
    return ftruncate(journal->file, (off_t)length) == 0 && (journal->reader = freopen(journal->path, "rb", journal->reader));
}

static bool begin_or_go_on(Journal *journal, const cJSON *heading, Faults *faults)
{
    cJSON *was = NULL;
    int64_t length = heading_length(journal, &was);
    if (length == 0 || (!was && fseeko(journal->reader, 0, SEEK_END) == 0 && ftello(journal->reader) == (off_t)length)) {
        // new, or killed in its first line
        char *text = cJSON_PrintUnformatted(heading);
        bool is_cut = cut(journal, 0), good = is_cut && append(journal, text, faults);
        if (!is_cut)
            faults_add(faults, journal->path, 0, 0, "cannot be begun anew: %s", strerror(errno));
        free(text);
        return good;
    }
    if (!was)
        faults_add(faults, journal->path, 1, 1, "is not the journal of a sweep, or its first line is damaged; take a new folder");
    bool good = was && is_same(journal, was, heading, faults);
    cJSON_Delete(was);
    if (!good)
        return false;
    read_lines(journal, length, NULL, NULL);
    if (cut(journal, journal->end))
        return true;
    faults_add(faults, journal->path, 0, 0, "cannot be cut to its last whole line: %s", strerror(errno));
    return false;
}

Journal *journal_open(const char *folder, const cJSON *heading, int64_t runs, Faults *faults)
{
    Journal *journal = HEAP_ZEROED(1, sizeof *journal);
    char path[PATH_MAX];
    journal->file = journal->lock = -1;
    journal->runs = runs;
    snprintf(path, sizeof path, "%.4000s", folder);
    snprintf(journal->path, sizeof journal->path, "%.4000s/journal.txt", folder);
    bool good = folders_create(path);
    if (!good)
        faults_add(faults, folder, 0, 0, "cannot be created: %s; expected a folder for the results", strerror(errno));
    good = good && take_lock(journal, folder, faults);
    if (good && ((journal->file = open(journal->path, O_RDWR | O_CREAT | O_CLOEXEC, 0666)) < 0 || !(journal->reader = fopen(journal->path, "rb")))) {
        faults_add(faults, journal->path, 0, 0, "cannot be opened: %s", strerror(errno));
        good = false;
    }
    if (good && begin_or_go_on(journal, heading, faults))
        return journal;
    journal_close(journal);
    return NULL;
}

void journal_close(Journal *journal)
{
    if (!journal)
        return;
    if (journal->reader)
        fclose(journal->reader);
    if (journal->file >= 0) {
        fdatasync(journal->file);
        close(journal->file);
    }
    if (journal->lock >= 0)
        close(journal->lock);
    free(journal);
}

const char *journal_path(const Journal *journal) { return journal->path; }
