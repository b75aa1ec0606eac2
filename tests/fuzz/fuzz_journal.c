// Any bytes as the journal of a sweep: refused with a fault, or results of runs that exist; what is added then is read again, behind the results before it.
// Covers: study/journal.c
#include "study/journal.h"
#include "tests/fuzz/given_files.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { RUNS = 100 };

typedef struct Seen {
    int64_t count, last;
} Seen;

static void see(void *context, int64_t run, const char *text, int64_t offset)
{
    Seen *seen = context;
    if (run < 0 || run >= RUNS || offset <= 0 || !strstr(text, "run"))
        abort();
    seen->count++;
    seen->last = run;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    static const char *const names[] = {"journal.txt", "lock", NULL};
    given_files(data, size, names);
    cJSON *heading = cJSON_CreateObject();
    cJSON_AddNumberToObject(heading, "sweep", 1);
    faults_clear(&faults);
    Journal *journal = journal_open(given_folder, heading, RUNS, &faults);
    if (!journal != (faults.count > 0))
        abort();
    if (journal) {
        Seen before = {0}, after = {0};
        journal_read(journal, see, &before);
        if (!journal_add(journal, "{\"run\":99,\"status\":\"done\"}", &faults))
            abort();
        journal_close(journal);
        if (!(journal = journal_open(given_folder, heading, RUNS, &faults)))
            abort();
        journal_read(journal, see, &after);
        if (after.count != before.count + 1 || after.last != 99)
            abort();
        journal_close(journal);
    }
    cJSON_Delete(heading);
    return 0;
}
