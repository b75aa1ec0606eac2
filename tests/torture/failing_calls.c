// Makes chosen calls fail; loaded before the program (LD_PRELOAD).
//   FAIL_HEAP=N    the Nth allocation by the program's own code (recognised by the return address) fails (1: the first)
//   FAIL_LIST=F    the file F has numbers of allocations in ascending order. Each of them fails in a forked process, which continues in a copy of the working
//                  folder, FAIL_FOLDER/forks/N/work, with its output in `said` and `complained` beside it. Not if other threads run, as they do not survive a
//                  fork. Much faster than one by one
//   FAIL_FILE=N    the Nth system call on files below FAIL_FOLDER (a path that ends with /) and on standard output fails with FAIL_ERROR, in any library:
//                  the calls are trapped by seccomp where that is permitted (x86-64)
//   FAIL_MODE      once (default); full: the Nth and all later ones that write; gone: the Nth and all later ones; short: reads and writes transfer half of the
//                  requested bytes, at least one; interrupted: each of them ends with EINTR every other time
// At the end FAIL_LOG gets the count of allocations and of file calls, then a line for each place in the program that allocates: the number of its first call,
// its address. The call that failed is written there at once: `failed`, the call, the file; or `fork`, its number, the process's status, its place.
#define _GNU_SOURCE      // dl_iterate_phdr, RTLD_NEXT
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <limits.h>
#include <link.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static uintptr_t program, text_begin, text_end;
static long fail_heap, fail_file;
static int fail_error = EIO;
static enum { NONE, ONCE, FULL, GONE, SHORT, INTERRUPTED } mode;
static atomic_long heap_count, file_count;
static int log_file = -1;
static const char *folder;
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

static long number(const char *name)
{
    const char *text = getenv(name);
    return text ? atol(text) : 0;
}

// --- the heap ---

static void see(uintptr_t address, long count)
{
    for (size_t i = address % MOST_PLACES;; i = (i + 1) % MOST_PLACES) {
        uintptr_t free_place = 0;
        if (atomic_compare_exchange_strong(&place[i].address, &free_place, address))
            place[i].first = count;
        if (free_place == 0 || free_place == address)
            return;
    }
}

// --- in a forked process ---

enum { MOST_LISTED = 1 << 17, FORK_SECONDS = 60 };
static long list[MOST_LISTED];
static int list_count, list_next;
static char work[PATH_MAX], copy[PATH_MAX];      // the working folder, and its copy for that process

static void copy_bytes(const char *from, const char *to)
{
    char part[65536];
    int in = open(from, O_RDONLY | O_CLOEXEC), out = open(to, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    for (ssize_t got; in >= 0 && out >= 0 && (got = read(in, part, sizeof part)) > 0;)
        if (write(out, part, (size_t)got) != got)
            _exit(124);
    close(in);
    close(out);
}

static int copy_entry(const char *path, const struct stat *status, int kind, struct FTW *where)
{
    char to[2 * PATH_MAX];
    snprintf(to, sizeof to, "%s%s", copy, path + strlen(work));
    if (kind == FTW_D)
        mkdir(to, 0777);
    else
        copy_bytes(path, to);
    if (kind != FTW_D || where->level > 0)
        utimensat(AT_FDCWD, to, (struct timespec[2]){status->st_atim, status->st_mtim}, 0);
    return 0;
}

// Reopens each open file at its position: files of the working folder as their copies, others so that both processes have separate positions.
static void open_anew(void)
{
    for (int i = 0; i < 64; i++) {
        char link[40], path[PATH_MAX], to[2 * PATH_MAX];
        snprintf(link, sizeof link, "/proc/self/fd/%d", i);
        ssize_t length = readlink(link, path, sizeof path - 1);
        off_t at = lseek(i, 0, SEEK_CUR);
        if (length <= 0 || path[0] != '/' || at < 0)
            continue;
        path[length] = 0;
        bool is_copied = !strncmp(path, work, strlen(work)) && path[strlen(work)] == '/';
        snprintf(to, sizeof to, "%s%s", is_copied ? copy : path, is_copied ? path + strlen(work) : "");
        if (i == STDOUT_FILENO) {
            snprintf(to, sizeof to, "%s/../said", copy);
            copy_bytes(path, to);
        }
        int flags = fcntl(i, F_GETFL), keeps = fcntl(i, F_GETFD), file = open(to, flags & ~(O_CREAT | O_EXCL | O_TRUNC));
        if (file < 0)
            continue;
        lseek(file, at, SEEK_SET);
        dup2(file, i);
        fcntl(i, F_SETFD, keeps);
        close(file);
    }
}

// True in the process that continues with the failed allocation.
static bool is_fork(long count, uintptr_t place_of)
{
    struct stat tasks;
    int status;
    while (list_next < list_count && list[list_next] < count)
        list_next++;
    if (list_next == list_count || list[list_next] != count || stat("/proc/self/task", &tasks) != 0 || tasks.st_nlink != 3)
        return false;
    pid_t child = fork();
    if (child == 0) {
        char complained[PATH_MAX];
        snprintf(copy, sizeof copy, "%sforks/%ld", folder, count);
        mkdir(copy, 0777);
        snprintf(complained, sizeof complained, "%sforks/%ld/complained", folder, count);
        snprintf(copy, sizeof copy, "%sforks/%ld/work", folder, count);
        nftw(work, copy_entry, 16, FTW_PHYS);
        open_anew();
        int words = open(complained, O_WRONLY | O_CREAT | O_TRUNC, 0666);
        if (words < 0 || dup2(words, STDERR_FILENO) < 0 || chdir(copy) != 0)
            _exit(124);
        close(words);
        close(log_file);
        log_file = -1;
        list_count = 0;
        alarm(FORK_SECONDS);
        return true;
    }
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
        continue;
    if (child > 0)
        dprintf(log_file, "fork %ld %d 0x%lx\n", count, status, (unsigned long)place_of);
    return false;
}

static void read_list(const char *path)
{
    FILE *file = path ? fopen(path, "r") : NULL;
    while (file && list_count < MOST_LISTED && fscanf(file, "%ld", &list[list_count]) == 1)
        list_count++;
    if (file)
        fclose(file);
    if (!getcwd(work, sizeof work))
        list_count = 0;
}

static bool fails(const void *caller)
{
    uintptr_t at = (uintptr_t)caller;
    if (at < text_begin || at >= text_end)
        return false;
    long count = atomic_fetch_add(&heap_count, 1) + 1;
    see(at, count);
    if (list_count && is_fork(count, at - program)) {
        errno = ENOMEM;
        return true;
    }
    if (count != fail_heap)
        return false;
    if (log_file >= 0)
        dprintf(log_file, "failed allocation 0x%lx\n", (unsigned long)(at - program));
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

// --- files ---
#if defined(__x86_64__)
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <stddef.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>

// The filter passes only calls from here.
long real_call(long call, long a, long b, long c, long d, long e, long f);
extern char after_real_call[];
__asm__(".text\n.globl real_call\n.type real_call,@function\nreal_call:\n"
        "mov %rdi,%rax\nmov %rsi,%rdi\nmov %rdx,%rsi\nmov %rcx,%rdx\nmov %r8,%r10\nmov %r9,%r8\nmov 8(%rsp),%r9\nsyscall\n"
        ".globl after_real_call\nafter_real_call:\nret\n");

enum { BY_DESCRIPTOR = 1, BY_PATH = 2, BY_FOLDER_AND_PATH = 4, MOVES = 8, WRITES = 16 };
static const struct {
    int call, kind;
    const char *name;
} trapped[] = {
    {SYS_read, BY_DESCRIPTOR | MOVES, "read"},
    {SYS_pread64, BY_DESCRIPTOR | MOVES, "pread"},
    {SYS_write, BY_DESCRIPTOR | MOVES | WRITES, "write"},
    {SYS_pwrite64, BY_DESCRIPTOR | MOVES | WRITES, "pwrite"},
    {SYS_writev, BY_DESCRIPTOR | WRITES, "writev"},
    {SYS_fsync, BY_DESCRIPTOR, "fsync"},
    {SYS_fdatasync, BY_DESCRIPTOR, "fdatasync"},
    {SYS_ftruncate, BY_DESCRIPTOR | WRITES, "ftruncate"},
    {SYS_fallocate, BY_DESCRIPTOR | WRITES, "fallocate"},
    {SYS_fchmod, BY_DESCRIPTOR, "fchmod"},
    {SYS_fchown, BY_DESCRIPTOR, "fchown"},
    {SYS_fstat, BY_DESCRIPTOR, "fstat"},
    {SYS_close, BY_DESCRIPTOR, "close"},
    {SYS_getdents64, BY_DESCRIPTOR, "getdents"},
    {SYS_open, BY_PATH, "open"},
    {SYS_openat, BY_FOLDER_AND_PATH, "open"},
    {SYS_mkdir, BY_PATH | WRITES, "mkdir"},
    {SYS_mkdirat, BY_FOLDER_AND_PATH | WRITES, "mkdir"},
    {SYS_rename, BY_PATH, "rename"},
    {SYS_renameat, BY_FOLDER_AND_PATH, "rename"},
    {SYS_renameat2, BY_FOLDER_AND_PATH, "rename"},
    {SYS_link, BY_PATH, "link"},
    {SYS_linkat, BY_FOLDER_AND_PATH, "link"},
};
enum { TRAPPED = sizeof trapped / sizeof *trapped };

static size_t path_of(int descriptor, char *path, size_t room)
{
    char link[40];
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    long length = real_call(SYS_readlink, (long)link, (long)path, (long)room - 1, 0, 0, 0);
    path[length > 0 ? length : 0] = 0;
    return length > 0 ? (size_t)length : 0;
}

static bool is_ours(int kind, const long *argument, char *path, size_t room)
{
    if (kind & BY_DESCRIPTOR) {
        if (argument[0] == STDERR_FILENO || argument[0] == log_file)
            return false;
        return path_of((int)argument[0], path, room) && (argument[0] == STDOUT_FILENO || !strncmp(path, folder, strlen(folder)));
    }
    const char *name = (const char *)argument[kind & BY_PATH ? 0 : 1];
    snprintf(path, room, "%s", name);
    return name[0] != '/' || !strncmp(path, folder, strlen(folder));
}

static long answer(int i, const long *argument)
{
    static atomic_long moved;
    char path[1000];
    int kind = trapped[i].kind, call = trapped[i].call;
    long changed[6];
    memcpy(changed, argument, sizeof changed);
    if (mode && is_ours(kind, argument, path, sizeof path)) {
        long count = atomic_fetch_add(&file_count, 1) + 1;
        bool creates = (call == SYS_open && argument[1] & O_CREAT) || (call == SYS_openat && argument[2] & O_CREAT);
        bool is_later = fail_file && count >= fail_file;
        if ((mode == ONCE && count == fail_file) || (mode == FULL && is_later && (kind & WRITES || creates)) || (mode == GONE && is_later)) {
            if (log_file >= 0 && (mode == ONCE || count == fail_file))
                dprintf(log_file, "failed %s %s\n", trapped[i].name, path);
            if (call == SYS_close)
                real_call(call, argument[0], 0, 0, 0, 0, 0);
            return -fail_error;
        }
        if (mode == SHORT && kind & MOVES && argument[2] > 1)
            changed[2] = argument[2] / 2;
        if (mode == INTERRUPTED && !(kind & BY_DESCRIPTOR && argument[0] == STDOUT_FILENO) && (kind & (MOVES | WRITES)) && kind & BY_DESCRIPTOR &&
            atomic_fetch_add(&moved, 1) % 2 == 0)
            return -EINTR;
    }
    return real_call(call, changed[0], changed[1], changed[2], changed[3], changed[4], changed[5]);
}

static void on_trap(int signal_number, siginfo_t *info, void *context)
{
    (void)signal_number;
    greg_t *r = ((ucontext_t *)context)->uc_mcontext.gregs;
    int before = errno;
    const long argument[6] = {r[REG_RDI], r[REG_RSI], r[REG_RDX], r[REG_R10], r[REG_R8], r[REG_R9]};
    for (int i = 0; i < TRAPPED; i++)
        if (trapped[i].call == info->si_syscall)
            r[REG_RAX] = answer(i, argument);
    errno = before;
}

static bool trap_file_calls(void)
{
    uint64_t from = (uint64_t)(uintptr_t)after_real_call;
    struct sock_filter filter[TRAPPED + 9];
    int n = 0;
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, instruction_pointer));
    filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)from, 0, 3);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, instruction_pointer) + 4);
    filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)(from >> 32), 0, 1);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr));
    for (int i = 0; i < TRAPPED; i++)
        filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)trapped[i].call, (uint8_t)(TRAPPED - i), 0);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP);
    struct sock_fprog code = {.len = (unsigned short)n, .filter = filter};
    struct sigaction trap = {.sa_sigaction = on_trap, .sa_flags = SA_SIGINFO | SA_NODEFER | SA_RESTART};
    return sigaction(SIGSYS, &trap, NULL) == 0 && prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &code) == 0;
}

// A thread that blocks signals would be killed by its first trapped call.
int pthread_sigmask(int how, const sigset_t *set, sigset_t *before)
{
    typedef int Mask(int, const sigset_t *, sigset_t *);
    static Mask *next;
    sigset_t most;
    if (!next)
        *(void **)&next = dlsym(RTLD_NEXT, "pthread_sigmask");
    if (set) {
        most = *set;
        sigdelset(&most, SIGSYS);
    }
    return next(how, set ? &most : NULL, before);
}
#else
static bool trap_file_calls(void) { return false; }
#endif

__attribute__((constructor)) static void begin(void)
{
    static const char *const names[] = {"", "once", "full", "gone", "short", "interrupted"};
    const char *wanted = getenv("FAIL_MODE"), *log_path = getenv("FAIL_LOG");
    fail_heap = number("FAIL_HEAP");
    fail_file = number("FAIL_FILE");
    fail_error = getenv("FAIL_ERROR") ? (int)number("FAIL_ERROR") : EIO;
    dl_iterate_phdr(find_program, NULL);
    int log_now = log_path ? open(log_path, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666) : -1;
    if (log_now >= 0) {      // away from the file descriptors that the program expects
        log_file = fcntl(log_now, F_DUPFD_CLOEXEC, 200);
        close(log_now);
    }
    for (int i = ONCE; wanted && i <= INTERRUPTED; i++)
        if (!strcmp(wanted, names[i]))
            mode = i;
    folder = getenv("FAIL_FOLDER");
    read_list(getenv("FAIL_LIST"));
    if (mode && (!folder || !trap_file_calls()))
        _exit(77);
}

__attribute__((destructor)) static void end(void)
{
    if (log_file < 0)
        return;
    dprintf(log_file, "calls %ld %ld\n", atomic_load(&heap_count), atomic_load(&file_count));
    for (int i = 0; i < MOST_PLACES; i++)
        if (atomic_load(&place[i].address))
            dprintf(log_file, "place %ld 0x%lx\n", place[i].first, (unsigned long)(atomic_load(&place[i].address) - program));
}
