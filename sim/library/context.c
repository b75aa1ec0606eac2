#include "sim/library/context.h"

#include "base/base.h"
#include "recon/recon.h"
#include "sim/library/allocator.h"

#include <locale.h>
#include <stdlib.h>
#include <string.h>

#define TEXT(number) #number
#define NUMBER(number) TEXT(number)
_Static_assert(sizeof SELDINGER_VERSION == sizeof NUMBER(SEL_VERSION_MAJOR) "." NUMBER(SEL_VERSION_MINOR) "." NUMBER(SEL_VERSION_PATCH),
               "include/seldinger/base.h has another version");

const char *sel_version(void) { return SELDINGER_VERSION; }

const char *sel_status_name(SelStatus status)
{
    static const char *const name[] = {"done", "bad argument", "bad input", "output cannot be written", "not enough memory", "not possible now", "different"};
    return (size_t)status < sizeof name / sizeof *name ? name[status] : "unknown";
}

void sel_free(void *text) { free(text); }

// --- options and results ---

bool options_take(void *own, size_t own_size, const void *given)
{
    enum { MOST = 1 << 16 };
    size_t size = sizeof size;
    if (!given)
        return true;
    memcpy(&size, given, sizeof size);
    if (size < sizeof size || size > MOST)
        return false;
    memcpy(own, given, size < own_size ? size : own_size);
    memcpy(own, &own_size, sizeof own_size);
    return true;
}

void result_give(void *out, size_t size, void *own, size_t own_size)
{
    memcpy(own, &size, sizeof size);
    memset(out, 0, size);
    memcpy(out, own, size < own_size ? size : own_size);
}

void sel_context_options_init(SelContextOptions *options, size_t size)
{
    SelContextOptions own = {0};
    result_give(options, size, &own, sizeof own);
}

// --- contexts ---

SelContext *context_held(SelContext *context)
{
    atomic_fetch_add(&context->holders, 1);
    return context;
}

void context_release(SelContext *context)
{
    if (context && atomic_fetch_sub(&context->holders, 1) == 1)
        free(context);
}

SelStatus sel_context_create(const SelContextOptions *options, SelContext **out)
{
    SelContextOptions own = {0};
    if (!out || !options_take(&own, sizeof own, options))
        return SEL_ERROR_ARGUMENT;
    allocator_settle();
    SelContext *context = calloc(1, sizeof *context);
    if (!context)
        return SEL_ERROR_MEMORY;
    context->options = own;
    atomic_init(&context->holders, 1);
    *out = context;
    return SEL_OK;
}

void sel_context_destroy(SelContext *context) { context_release(context); }

int sel_fault_count(const SelContext *context)
{
    int count = context ? context->faults.count : 0;
    return count < FAULTS_CAPACITY ? count : FAULTS_CAPACITY;
}

const char *sel_fault(const SelContext *context, int index) { return index >= 0 && index < sel_fault_count(context) ? context->faults.text[index] : ""; }

// --- calls ---

static _Thread_local SelContext *current;

typedef struct Call {
    SelContext *context;
    Work work;
    void *what;
    bool is_good;
} Call;

static void make_call(void *argument)
{
    Call *call = argument;
    call->is_good = call->work(call->context, call->what);
}

// Numbers in files have a decimal point, whatever the host's language.
static locale_t plain_locale(void)
{
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    return plain ? uselocale(plain) : (locale_t)0;
}

static void former_locale(locale_t former)
{
    if (former)
        freelocale(uselocale(former));
}

// Restores the HDF5 settings even if the call is aborted. Reading them initialises the HDF5 library, whose own shutdown at the host's exit then remains.
static bool try_call(Call *call, size_t *lacking)
{
    Hdf5Silence silence = hdf5_silence_begin();
    unsigned plugins = 0;
    bool has_plugins = H5PLget_loading_state(&plugins) >= 0, is_whole = heap_try(make_call, call, lacking);
    if (!is_whole && has_plugins)
        H5PLset_loading_state(plugins);
    hdf5_silence_end(silence);
    return is_whole;
}

SelStatus context_call(SelContext *context, Work work, void *what, SelStatus otherwise)
{
    Call call = {.context = context, .work = work, .what = what};
    size_t lacking = 0;
    SelContext *around = current;
    faults_clear(&context->faults);
    current = context;
    locale_t former = plain_locale();
    bool is_whole = try_call(&call, &lacking);
    former_locale(former);
    current = around;
    if (!is_whole)
        faults_add(&context->faults, "seldinger", 0, 0, "out of memory: a request for at least %zu bytes failed", lacking);
    return !is_whole ? SEL_ERROR_MEMORY : call.is_good && context->faults.count == 0 ? SEL_OK : otherwise;
}

// For a call that does no work of its own: clears the faults. Returns false if the context is NULL.
static bool context_begin(SelContext *context)
{
    if (context)
        faults_clear(&context->faults);
    return context != NULL;
}

SelStatus context_refuse(SelContext *context, SelStatus status, const char *function, const char *text)
{
    if (context_begin(context))
        faults_add(&context->faults, function, 0, 0, "%s", text);
    return status;
}

// --- messages ---

static void pass_progress(void *argument, long done, long total)
{
    const SelContext *context = argument;
    context->options.progress(context->options.user, done, total);
}

Progress context_progress(SelContext *context) { return context->options.progress ? (Progress){.call = pass_progress, .context = context} : (Progress){0}; }

void context_message(SelContext *context, SelMessageLevel level, const char *path, const char *text)
{
    char line[FAULT_LENGTH];
    while (context && context->options.message && *text) {
        size_t length = strcspn(text, "\n");
        snprintf(line, sizeof line, "%.200s: %.*s", path, (int)length, text);
        context->options.message(context->options.user, level, line);
        text += length + (text[length] == '\n');
    }
}

void context_note(const char *path, const char *text) { context_message(current, SEL_NOTE, path, text); }

// --- hands ---

ToolCommands commands_of(const SelHand *hand)
{
    ToolCommands commands = {0};
    for (int k = 0; hand && k < TOOLS_MOST; k++) {
        const SelCommand *from = &hand->tool[k];
        commands.tool[k] = (Command){.push_mm_s = from->push_mm_s, .twist_deg_s = from->twist_deg_s};
        commands.released |= from->released ? 1u << k : 0;
        commands.fitted[k] = from->device;
    }
    if (hand && hand->contrast_ml_s > 0 && hand->contrast_tool > 0) {
        commands.contrast_ml_s = hand->contrast_ml_s;
        commands.contrast_tool = hand->contrast_tool;
    }
    return commands;
}

SelHand hand_of(const ToolCommands *commands)
{
    SelHand hand = {.contrast_ml_s = commands->contrast_ml_s, .contrast_tool = commands->contrast_tool};
    for (int k = 0; k < SEL_TOOLS_MOST; k++)
        hand.tool[k] = (SelCommand){.push_mm_s = commands->tool[k].push_mm_s,
                                    .twist_deg_s = commands->tool[k].twist_deg_s,
                                    .released = commands->released >> k & 1,
                                    .device = commands->fitted[k]};
    return hand;
}

_Static_assert((int)SEL_TOOLS_MOST == (int)TOOLS_MOST, "a hand for each tool");

static bool is_within(double value, double most) { return value >= -most && value <= most; }

const char *hand_trouble(const SelHand *hand)
{
    for (int k = 0; hand && k < SEL_TOOLS_MOST; k++) {
        const SelCommand *command = &hand->tool[k];
        if (!is_within(command->push_mm_s, SCRIPT_FASTEST_MM_S))
            return "push_mm_s is not within -1000 to 1000";
        if (!is_within(command->twist_deg_s, SCRIPT_FASTEST_DEG_S))
            return "twist_deg_s is not within -36000 to 36000";
        if (command->device < 0 || command->device > EXCHANGES_MOST)
            return "device is not within 0 to 4";
    }
    if (hand && !(hand->contrast_ml_s >= 0 && hand->contrast_ml_s <= SCRIPT_MOST_ML_S))
        return "contrast_ml_s is not within 0 to 50";
    return hand && (hand->contrast_tool < 0 || hand->contrast_tool > SEL_TOOLS_MOST) ? "contrast_tool is not within 0 to 4" : NULL;
}
