// The encoder writes into an unnamed file in the folder of the video, so that nothing is left behind, whichever process ends first. Frames go through a socket,
// so that a dead encoder causes an error of send() and not SIGPIPE; its standard error is read concurrently, so that it never blocks. Colours
// are BT.709 in studio range and are tagged so, as players expect for high definition.
#include "render/movie_file.h"

#include "base/base.h"
#include "render/message.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { LEAST_SIDE = 2, MOST_SIDE = 8192, OUTPUT = 3, MESSAGE_BYTES = 400, PATIENCE_S = 60 };

struct MovieFile {
    char *path;
    int width, height;           // as given
    int even_width, even_height;
    uint8_t *even;               // (even_height, even_width, 3); NULL if the given size is even
    pid_t encoder;
    int frames, messages, output; // descriptors: our ends of both sockets, and the unnamed file
    int count;
    bool failed, late;
    char message_text[MESSAGE_BYTES + 1];
    size_t message_length;
};

extern char **environ;

static void forget(MovieFile *movie)
{
    const int open[] = {movie->frames, movie->messages, movie->output};
    for (int i = 0; i < 3; i++)
        if (open[i] >= 0)
            close(open[i]);
    free(movie->path);
    free(movie->even);
    free(movie);
}

// A file in the folder of `path` without a name; -1 with errno.
static int nameless_file(const char *path)
{
    PartFile part;
    if (!part_file_begin(&part, path))
        return -1;
    int file = fcntl(part.descriptor, F_DUPFD_CLOEXEC, 0);
    part_file_drop(&part);
    return file;
}

static int spawn_encoder(MovieFile *movie, double fps, int frames, int messages)
{
    char size[32], rate[32];
    snprintf(size, sizeof size, "%dx%d", movie->even_width, movie->even_height);
    snprintf(rate, sizeof rate, "%ld/1000", lround(fps * 1000));
    char *const argument[] = {"ffmpeg",
                              "-nostdin",
                              "-hide_banner",
                              "-loglevel",
                              "error",
                              "-f",
                              "rawvideo",
                              "-pixel_format",
                              "rgb24",
                              "-video_size",
                              size,
                              "-framerate",
                              rate,
                              "-i",
                              "pipe:0",
                              "-an",
                              "-vf",
                              "scale=out_color_matrix=bt709:out_range=tv:flags=bilinear+accurate_rnd+bitexact,format=yuv420p",
                              "-colorspace",
                              "bt709",
                              "-color_primaries",
                              "bt709",
                              "-color_trc",
                              "bt709",
                              "-color_range",
                              "tv",
                              "-c:v",
                              "libx264",
                              "-preset",
                              "veryfast",
                              "-crf",
                              "21",
                              "-threads",
                              "1",
                              "-map_metadata",
                              "-1",
                              "-fflags",
                              "+bitexact",
                              "-flags:v",
                              "+bitexact",
                              "-movflags",
                              "+faststart",
                              "-f",
                              "mp4",
                              "-y",
                              "/proc/self/fd/3",
                              NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, frames, STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, messages, STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&actions, movie->output, OUTPUT);
    posix_spawnattr_init(&attributes);
    sigset_t none, plain;
    sigemptyset(&none);
    sigemptyset(&plain);
    sigaddset(&plain, SIGPIPE);
    sigaddset(&plain, SIGTERM);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &plain);
    posix_spawnattr_setpgroup(&attributes, 0);   // Ctrl-C is for this process only, which may still finish the video
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    int why = posix_spawnp(&movie->encoder, argument[0], &actions, &attributes, argument, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return why;
}

// Creates the sockets and starts the encoder. Returns false with errno.
static bool start_encoder(MovieFile *movie, double fps)
{
    int frames[2], messages[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, frames) != 0)
        return false;
    movie->frames = frames[0];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, messages) != 0) {
        close(frames[1]);
        return false;
    }
    movie->messages = messages[0];
    int why = spawn_encoder(movie, fps, frames[1], messages[1]);
    close(frames[1]);
    close(messages[1]);
    errno = why;
    return why == 0;
}

MovieFile *movie_file_create(const char *path, int width, int height, double fps, char *message, size_t capacity)
{
    struct stat status;
    if (width < LEAST_SIDE || height < LEAST_SIDE || width > MOST_SIDE || height > MOST_SIDE) {
        message_fail(message, capacity, "%s: cannot make a video of %d x %d pixels; expected sides of %d to %d", path, width, height, LEAST_SIDE, MOST_SIDE);
        return NULL;
    }
    if (!(fps >= 0.001) || fps > 1000) {
        message_fail(message, capacity, "%s: cannot make a video with %g frames per second; expected above 0, at most 1000", path, fps);
        return NULL;
    }
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode)) {
        message_fail(message, capacity, "%s: exists and is not a regular file; give another name", path);
        return NULL;
    }
    MovieFile *movie = calloc(1, sizeof *movie);
    if (movie) {
        *movie = (MovieFile){.path = strdup(path), .width = width, .height = height, .frames = -1, .messages = -1, .output = -1};
        movie->even_width = width + width % 2;
        movie->even_height = height + height % 2;
        bool odd = movie->even_width != width || movie->even_height != height;
        movie->even = odd ? malloc((size_t)movie->even_width * (size_t)movie->even_height * 3) : NULL;
        if (!movie->path || (odd && !movie->even)) {
            forget(movie);
            movie = NULL;
        }
    }
    if (!movie) {
        message_fail(message, capacity, "%s: out of memory", path);
        return NULL;
    }
    movie->output = nameless_file(path);
    if (movie->output < 0) {
        message_fail(message, capacity, "%s: cannot be written: %s; give a file in a folder with write permission", path, strerror(errno));
    } else if (!start_encoder(movie, fps)) {
        if (errno == ENOENT)
            message_fail(message, capacity, "%s: the program ffmpeg, which encodes videos, was not found: install ffmpeg", path);
        else
            message_fail(message, capacity, "%s: cannot start ffmpeg: %s", path, strerror(errno));
    } else {
        return movie;
    }
    forget(movie);
    return NULL;
}

// Reads the encoder's messages so far or, with `wait`, until it ends; keeps the last part.
static void listen_to_encoder(MovieFile *movie, bool wait)
{
    for (;;) {
        char received[MESSAGE_BYTES];
        ssize_t count = recv(movie->messages, received, sizeof received, wait ? 0 : MSG_DONTWAIT);
        if (count < 0 && errno == EINTR)
            continue;
        if (count <= 0)
            return;
        size_t size = (size_t)count, keep = movie->message_length + size > MESSAGE_BYTES ? MESSAGE_BYTES - size : movie->message_length;
        memmove(movie->message_text, movie->message_text + movie->message_length - keep, keep);
        memcpy(movie->message_text + keep, received, size);
        movie->message_length = keep + size;
    }
}

// Also reads the encoder's messages meanwhile, to avoid a deadlock.
static bool send_all(MovieFile *movie, const uint8_t *bytes, size_t size)
{
    struct pollfd ends[] = {{.fd = movie->frames, .events = POLLOUT}, {.fd = movie->messages, .events = POLLIN}};
    while (size > 0) {
        int ready = poll(ends, 2, 1000 * PATIENCE_S);
        if (ready < 0 && errno == EINTR)
            continue;
        movie->late = ready == 0;
        if (ready <= 0)
            return false;
        if (ends[1].revents & POLLIN)
            listen_to_encoder(movie, false);
        else if (ends[1].revents)
            return false;   // the encoder has ended
        if (!ends[0].revents)
            continue;
        ssize_t count = send(movie->frames, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (count < 0 && (errno == EINTR || errno == EAGAIN || errno == EWOULDBLOCK))
            continue;
        if (count <= 0)
            return false;
        bytes += count;
        size -= (size_t)count;
    }
    return true;
}

bool movie_file_add(MovieFile *movie, const uint8_t *rgb)
{
    if (movie->failed)
        return false;
    if (movie->even) {
        size_t row = (size_t)movie->width * 3, even_row = (size_t)movie->even_width * 3;
        for (int y = 0; y < movie->even_height; y++) {
            const uint8_t *from = rgb + (size_t)(y < movie->height ? y : movie->height - 1) * row;
            uint8_t *to = movie->even + (size_t)y * even_row;
            memcpy(to, from, row);
            if (even_row > row)
                memcpy(to + row, from + row - 3, 3);
        }
        rgb = movie->even;
    }
    movie->failed = !send_all(movie, rgb, (size_t)movie->even_width * (size_t)movie->even_height * 3);
    movie->count += !movie->failed;
    return !movie->failed;
}

int movie_file_count(const MovieFile *movie) { return movie->count; }

// Waits for the end of the encoder; returns its status as from waitpid().
static int end_encoder(MovieFile *movie, bool kill_it)
{
    int status = -1;
    shutdown(movie->frames, SHUT_RDWR);
    if (kill_it)
        kill(movie->encoder, SIGKILL);
    listen_to_encoder(movie, true);
    while (waitpid(movie->encoder, &status, 0) < 0 && errno == EINTR)
        ;
    return status;
}

// Links the unnamed file to its final path. Returns false with errno.
static bool publish(const MovieFile *movie)
{
    size_t capacity = 1 << 20;
    char *buffer = malloc(capacity);
    PartFile part;
    if (!buffer || !part_file_begin(&part, movie->path)) {
        free(buffer);
        return false;
    }
    ssize_t count = 0;
    bool good = true;
    for (off_t at = 0; good && (count = pread(movie->output, buffer, capacity, at)) > 0; at += count)
        good = part_file_write(&part, buffer, (size_t)count);
    good = good && count == 0 && part_file_finish_synced(&part);
    part_file_drop(&part);
    free(buffer);
    return good;
}

// The last non-empty line of the encoder's messages.
static const char *last_line(MovieFile *movie)
{
    char *text = movie->message_text;
    while (movie->message_length > 0 && (unsigned char)text[movie->message_length - 1] <= ' ')
        movie->message_length--;
    text[movie->message_length] = 0;
    char *line = strrchr(text, '\n');
    return line ? line + 1 : text;
}

bool movie_file_close(MovieFile *movie, char *message, size_t capacity)
{
    struct stat status;
    int ended = end_encoder(movie, movie->late || movie->count == 0);
    const char *messages = last_line(movie);
    bool good = false;
    if (movie->late)
        message_fail(message, capacity, "%s: ffmpeg accepted no frame for %d s; no video was written", movie->path, PATIENCE_S);
    else if (movie->count == 0 && !movie->failed)
        message_fail(message, capacity, "%s: the video has no frames; expected at least one", movie->path);
    else if (WIFSIGNALED(ended))
        message_fail(message, capacity, "%s: ffmpeg was ended by signal %d after %d frames; no video was written", movie->path, WTERMSIG(ended), movie->count);
    else if (movie->failed || !WIFEXITED(ended) || WEXITSTATUS(ended) != 0 || messages[0])
        message_fail(message, capacity, "%s: ffmpeg failed: %s; no video was written", movie->path,
                     messages[0] ? messages : "it ended early without a message");
    else if (fstat(movie->output, &status) != 0 || status.st_size == 0)
        message_fail(message, capacity, "%s: ffmpeg wrote nothing; no video was written", movie->path);
    else if (!(good = publish(movie)))
        message_fail(message, capacity, "%s: cannot be written: %s", movie->path, strerror(errno));
    forget(movie);
    return good;
}

void movie_file_abandon(MovieFile *movie)
{
    if (!movie)
        return;
    end_encoder(movie, true);
    forget(movie);
}
