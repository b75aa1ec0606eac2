#include "recon/volume/volume_dicom_pixels.h"

#include "base/base.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

// The program's memory limit: it holds the compressed file, the pixels and the output at once, each of them twice.
enum { LIBRARIES_BYTES = 1 << 28, COPIES = 6, SLOWEST_BYTES_S = 1 << 20, LEAST_S = 20 };

// In the child process: runs `program`, which reads `file` and writes the decoded image to `answer`.
static void start(const char *program, int file, int answer, size_t most)
{
    rlim_t memory = (rlim_t)LIBRARIES_BYTES + COPIES * (rlim_t)most;
    unsigned seconds = LEAST_S + (unsigned)(most / SLOWEST_BYTES_S);
    if (dup2(file, STDIN_FILENO) < 0 || dup2(answer, STDOUT_FILENO) < 0)
        _exit(127);
    process_be_expendable(seconds, 10 * seconds);
    setrlimit(RLIMIT_AS, &(struct rlimit){memory, memory});
    execv(program, (char *const[]){(char *)program, NULL});
    _exit(127);
}

// Reads all output of the program, up to `most` bytes. Returns false if there is more, or if out of memory.
static bool take_answer(int answer, size_t most, uint8_t **byte, size_t *length)
{
    size_t capacity = 0;
    *byte = NULL;
    *length = 0;
    for (;;) {
        if (*length == capacity) {
            capacity = capacity ? 2 * capacity : (size_t)1 << 20;
            uint8_t *more = capacity / 2 <= most ? realloc(*byte, capacity) : NULL;
            if (!more)
                return false;
            *byte = more;
        }
        ssize_t part = read(answer, *byte + *length, capacity - *length);
        if (part == 0)
            return *length <= most;
        if (part < 0 && errno != EINTR)
            return false;
        *length += part > 0 ? (size_t)part : 0;
    }
}

static bool run(const char *program, int file, size_t most, FileBytes *out)
{
    int pipes[2], status = -1;
    uint8_t *byte = NULL;
    size_t length = 0;
    if (pipe(pipes) != 0)
        return false;
    fcntl(pipes[0], F_SETFD, FD_CLOEXEC);
    fcntl(pipes[1], F_SETFD, FD_CLOEXEC);
    pid_t child = fork();
    if (child == 0)
        start(program, file, pipes[1], most);
    close(pipes[1]);
    bool good = child > 0 && take_answer(pipes[0], most, &byte, &length);
    close(pipes[0]);
    if (child > 0 && !good)
        kill(child, SIGKILL);
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    good = good && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (good) {
        out->byte = byte;
        out->length = out->whole = length;
    } else {
        free(byte);
    }
    return good;
}

bool dicom_unpack(const char *path, size_t place, const char *syntax, size_t most, FileBytes *out, Faults *faults)
{
    char program[4096];
    struct stat status;
    const char *why;
    *out = (FileBytes){.path = path};
    if (!process_beside("seldinger-dicom", program, sizeof program) || access(program, X_OK) != 0) {
        faults_add_at_byte(faults, path, place,
                           "the pixels are compressed (transfer syntax %s), and seldinger-dicom, which decodes them, is not installed next to "
                           "this program; decompress the file with `gdcmconv --raw IN.dcm OUT.dcm`",
                           syntax);
        return false;
    }
    int file = regular_file_open(path, &status, &why);
    if (file < 0) {
        faults_add(faults, path, 0, 0, "cannot be opened: %s; expected a readable file", why);
        return false;
    }
    bool good = run(program, file, most, out);
    close(file);
    if (!good)
        faults_add_at_byte(faults, path, place,
                           "cannot decode the compressed pixels (transfer syntax %s); expected an intact file in JPEG, JPEG-LS, JPEG 2000 or RLE", syntax);
    return good;
}
