// A heap that fails when it is asked to: loaded before the program (LD_PRELOAD), it counts what the program's own code allocates, by the address that the call
// returns to, and refuses the one whose number FAILING_HEAP_AT holds (1: the first). Libraries get what they ask for. At the end the file that
// FAILING_HEAP_COUNT names gets a line with the count, and one for each place in the program that allocates: the number of its first call, its address.
#define _GNU_SOURCE      // dl_iterate_phdr, RTLD_NEXT
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static uintptr_t program, text_begin, text_end;
static long fail_at;
static atomic_long count;
enum { MOST_PLACES = 4096 };
static struct {
    atomic_uintptr_t address;
    long first;
} place[MOST_PLACES];

static int find_program(struct dl_phdr_info *info, size_t size, void *context)
{
    (void)size, (void)context;
    for (int i = 0; i < info->dlpi_phnum; i++)
        if (info->dlpi_phdr[i].p_type == PT_LOAD && info->dlpi_phdr[i].p_flags & PF_X) {
            text_begin = info->dlpi_addr + info->dlpi_phdr[i].p_vaddr;
            text_end = text_begin + info->dlpi_phdr[i].p_memsz;
        }
    program = info->dlpi_addr;
    return 1;      // the first is the program
}

__attribute__((constructor)) static void begin(void)
{
    const char *at = getenv("FAILING_HEAP_AT");
    fail_at = at ? atol(at) : 0;
    dl_iterate_phdr(find_program, NULL);
}

__attribute__((destructor)) static void end(void)
{
    const char *path = getenv("FAILING_HEAP_COUNT");
    int file = path ? open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666) : -1;
    if (file < 0)
        return;
    dprintf(file, "%ld\n", atomic_load(&count));
    for (int i = 0; i < MOST_PLACES; i++)
        if (atomic_load(&place[i].address))
            dprintf(file, "%ld 0x%lx\n", place[i].first, (unsigned long)(atomic_load(&place[i].address) - program));
    close(file);
}

static void see(uintptr_t address, long number)
{
    for (size_t i = address % MOST_PLACES;; i = (i + 1) % MOST_PLACES) {
        uintptr_t free_place = 0;
        if (atomic_compare_exchange_strong(&place[i].address, &free_place, address))
            place[i].first = number;
        if (free_place == 0 || free_place == address)
            return;
    }
}

static bool fails(const void *caller)
{
    uintptr_t at = (uintptr_t)caller;
    if (at < text_begin || at >= text_end)
        return false;
    long number = atomic_fetch_add(&count, 1) + 1;
    see(at, number);
    if (number != fail_at)
        return false;
    errno = ENOMEM;
    return true;
}

#define CALLER __builtin_return_address(0)
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

void *malloc(size_t size) { return fails(CALLER) ? NULL : __libc_malloc(size); }
void *calloc(size_t values, size_t size) { return fails(CALLER) ? NULL : __libc_calloc(values, size); }
void *realloc(void *old, size_t size) { return fails(CALLER) ? NULL : __libc_realloc(old, size); }
void *aligned_alloc(size_t alignment, size_t size) { return fails(CALLER) ? NULL : __libc_memalign(alignment, size); }
int posix_memalign(void **out, size_t alignment, size_t size) { return fails(CALLER) || !(*out = __libc_memalign(alignment, size)) ? ENOMEM : 0; }

char *strndup(const char *text, size_t most)
{
    size_t length = strnlen(text, most);
    char *copy = fails(CALLER) ? NULL : __libc_malloc(length + 1);
    if (copy) {
        memcpy(copy, text, length);
        copy[length] = '\0';
    }
    return copy;
}
char *strdup(const char *text)
{
    size_t length = strlen(text);
    char *copy = fails(CALLER) ? NULL : __libc_malloc(length + 1);
    return copy ? memcpy(copy, text, length + 1) : NULL;
}
FILE *open_memstream(char **text, size_t *length)
{
    typedef FILE *Open(char **, size_t *);
    static Open *next;
    if (!next)
        *(void **)&next = dlsym(RTLD_NEXT, "open_memstream");
    return fails(CALLER) ? NULL : next(text, length);
}
