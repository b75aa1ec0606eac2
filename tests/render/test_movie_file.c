// Movies: ffmpeg reads back what was drawn; a failure gives a message and leaves no file.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/movie_file.h"

#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-movie-XXXXXX";
static char message[512];

static void need_ffmpeg(void)
{
    if (system("ffmpeg -hide_banner -loglevel error -encoders 2>/dev/null | grep -q libx264 && ffprobe -version >/dev/null 2>&1") == 0)
        return;
    print_message("skipped: no ffmpeg with libx264\n");
    skip();
}

static char *place(const char *name)
{
    static char path[300];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int files_there(void)
{
    DIR *list = opendir(folder);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(list));)
        count += entry->d_name[0] != '.';
    closedir(list);
    return count;
}

// A bright square of a quarter of the height that moves to the right, on a dark gradient.
static void draw(uint8_t *rgb, int width, int height, int frame)
{
    int side = height / 4, left = 2 + frame * (width - side - 4) / 30, top = height / 3;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            bool inside = x >= left && x < left + side && y >= top && y < top + side;
            uint8_t *p = rgb + 3 * (y * width + x);
            p[0] = (uint8_t)(inside ? 230 : 40 * y / height);
            p[1] = (uint8_t)(inside ? 200 : 40 * y / height + 10);
            p[2] = (uint8_t)(inside ? 60 : 40 * y / height + 20);
        }
}

static void write_movie(const char *path, int width, int height, double fps)
{
    MovieFile *movie = movie_file_create(path, width, height, fps, message, sizeof message);
    if (!movie)
        fail_msg("%s", message);
    uint8_t *rgb = malloc((size_t)(width * height * 3));
    assert_non_null(rgb);
    for (int i = 0; i < 30; i++) {
        draw(rgb, width, height, i);
        assert_true(movie_file_add(movie, rgb));
    }
    free(rgb);
    assert_int_equal(movie_file_count(movie), 30);
    if (!movie_file_close(movie, message, sizeof message))
        fail_msg("%s", message);
}

static void check_movie(const char *path, int width, int height, const char *rate)
{
    char command[900], line[200] = "", expected[100];
    int even_width = width + width % 2, even_height = height + height % 2;
    snprintf(command, sizeof command,
             "ffprobe -v error -count_frames -select_streams v -show_entries stream=codec_name,width,height,pix_fmt,r_frame_rate,nb_read_frames -of csv=p=0 "
             "'%s'",
             path);
    FILE *probe = popen(command, "r");
    assert_non_null(probe);
    assert_non_null(fgets(line, sizeof line, probe));
    pclose(probe);
    line[strcspn(line, "\r\n")] = 0;
    snprintf(expected, sizeof expected, "h264,%d,%d,yuv420p,%s,30", even_width, even_height, rate);
    assert_string_equal(line, expected);
    snprintf(command, sizeof command, "ffmpeg -nostdin -loglevel error -i '%s' -f rawvideo -pix_fmt rgb24 -vf scale=in_color_matrix=bt709 -", path);
    FILE *decode = popen(command, "r");
    assert_non_null(decode);
    size_t size = (size_t)(even_width * even_height * 3);
    uint8_t *got = malloc(size), *drawn = malloc((size_t)(width * height * 3));
    assert_true(got && drawn);
    for (int i = 0; i < 30; i++) {
        assert_int_equal(fread(got, 1, size, decode), size);
        draw(drawn, width, height, i);
        double square = 0;
        for (int y = 0; y < height; y++)
            for (int x = 0; x < 3 * width; x++)
                square += pow(got[y * even_width * 3 + x] - drawn[y * width * 3 + x], 2);
        // the error is largest in chroma, which has half the resolution, at the square's rim
        assert_true(sqrt(square / (3 * width * height)) < 8);
        int middle = 3 * ((height / 3 + height / 8) * even_width + 2 + i * (width - height / 4 - 4) / 30 + height / 8);
        assert_true(abs(got[middle] - 230) < 12 && abs(got[middle + 1] - 200) < 12 && abs(got[middle + 2] - 60) < 16);
        // the padding of an odd size repeats the edge
        for (int y = 0; y < even_height && even_width > width; y++)
            assert_true(abs(got[(y * even_width + width) * 3 + 1] - got[(y * even_width + width - 1) * 3 + 1]) < 12);
    }
    assert_int_equal(fread(got, 1, 1, decode), 0);
    pclose(decode);
    free(got);
    free(drawn);
}

static void what_is_read_is_what_was_drawn(void **state)
{
    (void)state;
    need_ffmpeg();
    write_movie(place("even.mp4"), 160, 120, 30);
    check_movie(place("even.mp4"), 160, 120, "30/1");
    write_movie(place("odd.mp4"), 161, 121, 7.5);
    check_movie(place("odd.mp4"), 161, 121, "15/2");
    write_movie(place("it's a.movie"), 64, 50, 12.5);   // no shell interprets it
    assert_int_equal(files_there(), 3);
    for (int i = 0; i < 3; i++)
        unlink(place(i == 0 ? "even.mp4" : i == 1 ? "odd.mp4" : "it's a.movie"));
}

static void the_same_frames_are_the_same_bytes(void **state)
{
    (void)state;
    need_ffmpeg();
    char command[700], other[300];
    write_movie(place("a.mp4"), 96, 64, 15);
    snprintf(other, sizeof other, "%s", place("a.mp4"));
    write_movie(place("b.mp4"), 96, 64, 15);
    snprintf(command, sizeof command, "cmp -s '%s' '%s'", other, place("b.mp4"));
    assert_int_equal(system(command), 0);
    unlink(other);
    unlink(place("b.mp4"));
}

static void what_cannot_be_is_reported(void **state)
{
    (void)state;
    const struct {
        int width, height;
        double fps;
        const char *path, *says;
    } bad[] = {{1, 20, 30, place("x"), "sides of 2 to 8192"},      {20, 9000, 30, "/tmp/x", "sides of 2 to 8192"},
               {20, 20, 0, "/tmp/x", "frames per second"},         {20, 20, NAN, "/tmp/x", "frames per second"},
               {20, 20, 30, "/tmp", "not a regular file"},         {20, 20, 30, "/dev/null", "not a regular file"},
               {20, 20, 30, "/nowhere/x.mp4", "cannot be written"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        message[0] = 0;
        assert_null(movie_file_create(bad[i].path, bad[i].width, bad[i].height, bad[i].fps, message, sizeof message));
        assert_non_null(strstr(message, bad[i].says));
    }
    assert_int_equal(files_there(), 0);
}

static void a_missing_ffmpeg_is_reported(void **state)
{
    (void)state;
    char *path = getenv("PATH"), *kept = path ? strdup(path) : NULL;
    setenv("PATH", folder, 1);
    MovieFile *movie = movie_file_create(place("x.mp4"), 64, 64, 30, message, sizeof message);
    if (kept)
        setenv("PATH", kept, 1);
    free(kept);
    assert_null(movie);
    assert_non_null(strstr(message, "install ffmpeg"));
    assert_int_equal(files_there(), 0);
}

static void an_older_movie_stays_until_the_new_one_is_whole(void **state)
{
    (void)state;
    need_ffmpeg();
    static uint8_t rgb[64 * 64 * 3];
    FILE *old = fopen(place("old.mp4"), "w");
    assert_non_null(old);
    fputs("old", old);
    fclose(old);
    for (int how = 0; how < 2; how++) {
        MovieFile *movie = movie_file_create(place("old.mp4"), 64, 64, 30, message, sizeof message);
        assert_non_null(movie);
        for (int i = 0; i < 5 && how == 0; i++)
            assert_true(movie_file_add(movie, rgb));
        if (how == 0) {
            movie_file_abandon(movie);
        } else {
            assert_false(movie_file_close(movie, message, sizeof message));
            assert_non_null(strstr(message, "no frames"));
        }
        assert_int_equal(files_there(), 1);
    }
    movie_file_abandon(NULL);
    old = fopen(place("old.mp4"), "r");
    assert_int_equal(fgetc(old), 'o');
    fclose(old);
    unlink(place("old.mp4"));
}

// Replaces ffmpeg by a script: its failures must reach the message.
static MovieFile *movie_by(const char *script)
{
    char *path = strdup(getenv("PATH")), other[600];
    FILE *file = fopen(place("ffmpeg"), "w");
    assert_non_null(file);
    fprintf(file, "#!/bin/sh\n%s\n", script);
    fclose(file);
    assert_int_equal(system("true"), 0);
    snprintf(other, sizeof other, "chmod 755 '%s'", place("ffmpeg"));
    assert_int_equal(system(other), 0);
    snprintf(other, sizeof other, "%s:%s", folder, path);
    setenv("PATH", other, 1);
    MovieFile *movie = movie_file_create(place("x.mp4"), 640, 480, 30, message, sizeof message);
    setenv("PATH", path, 1);
    free(path);
    assert_non_null(movie);
    return movie;
}

static void an_encoder_that_dies_is_a_message(void **state)
{
    (void)state;
    static uint8_t rgb[640 * 480 * 3];
    const struct {
        const char *script, *says;
    } ends[] = {{"head -c 2000000 >/dev/null; kill -KILL $$", "signal 9 after"},
                {"i=0; while [ $i -lt 3000 ]; do echo 'line of many words that nobody reads' >&2; i=$((i+1)); done; echo 'the disk is full' >&2; exit 1",
                 "ffmpeg failed: the disk is full"},
                {"cat >/dev/null; echo 'something went wrong' >&2", "something went wrong"},
                {"cat >/dev/null", "wrote nothing"},
                {"exit 3", "without a message"}};
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        MovieFile *movie = movie_by(ends[i].script);
        for (int k = 0; k < 30 && movie_file_add(movie, rgb); k++)
            ;
        assert_false(movie_file_close(movie, message, sizeof message));
        if (!strstr(message, ends[i].says))
            fail_msg("'%s' does not contain '%s'", message, ends[i].says);
        assert_int_equal(files_there(), 1);   // the script
    }
    unlink(place("ffmpeg"));
}

// No file may grow beyond 64 kB: ffmpeg's writes fail as on a full disk.
static void a_full_disk_is_a_message(void **state)
{
    (void)state;
    need_ffmpeg();
    char *path = place("full.mp4");
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        static uint8_t rgb[320 * 240 * 3];
        unsigned noise = 1;
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &(struct rlimit){1 << 16, 1 << 16});
        MovieFile *movie = movie_file_create(path, 320, 240, 30, message, sizeof message);
        bool going = movie != NULL;
        for (int i = 0; i < 40 && going; i++) {
            for (size_t k = 0; k < sizeof rgb; k++)
                rgb[k] = (uint8_t)((noise = noise * 1664525u + 1013904223u) >> 24);
            going = movie_file_add(movie, rgb);
        }
        bool closed = movie && movie_file_close(movie, message, sizeof message);
        if (!strstr(message, "full.mp4: ffmpeg failed: "))
            fprintf(stderr, "%s\n", message);
        _exit(movie && !closed && strstr(message, "full.mp4: ffmpeg failed: ") ? 0 : 2);
    }
    int status;
    waitpid(child, &status, 0);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    assert_int_equal(files_there(), 0);
}

// A program that is ended at any time leaves neither a temporary file nor an encoder.
static void a_stop_leaves_nothing(void **state)
{
    (void)state;
    need_ffmpeg();
    char *path = place("stopped.mp4");
    for (int trial = 0; trial < 4; trial++) {
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            static uint8_t rgb[320 * 240 * 3];
            MovieFile *movie = movie_file_create(path, 320, 240, 30, message, sizeof message);
            while (movie && movie_file_add(movie, rgb))
                ;
            _exit(2);
        }
        nanosleep(&(struct timespec){.tv_nsec = 20000000 + 60000000 * trial}, NULL);
        kill(child, trial % 2 ? SIGINT : SIGKILL);
        int status;
        waitpid(child, &status, 0);
        assert_true(WIFSIGNALED(status));
        assert_int_equal(files_there(), 0);
    }
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_read_is_what_was_drawn),
        cmocka_unit_test(the_same_frames_are_the_same_bytes),
        cmocka_unit_test(what_cannot_be_is_reported),
        cmocka_unit_test(a_missing_ffmpeg_is_reported),
        cmocka_unit_test(an_older_movie_stays_until_the_new_one_is_whole),
        cmocka_unit_test(an_encoder_that_dies_is_a_message),
        cmocka_unit_test(a_full_disk_is_a_message),
        cmocka_unit_test(a_stop_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
