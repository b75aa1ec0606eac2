// Files replace others completely or not at all and keep their permissions; the names of temporary files cannot be guessed or created in advance, and no
// temporary file remains.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/part_file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-part-XXXXXX";
#include "tests/folder.h"

static int parts_in_folder(void)
{
    DIR *directory = opendir(folder);
    int count = 0;
    assert_non_null(directory);
    for (struct dirent *entry; (entry = readdir(directory));)
        count += strstr(entry->d_name, ".part") != NULL;
    closedir(directory);
    return count;
}

static void write_whole(const char *path, const char *text)
{
    PartFile part;
    assert_true(part_file_begin(&part, path));
    assert_true(part_file_write(&part, text, strlen(text)));
    assert_true(part_file_finish_synced(&part));
}

static void expect_text(const char *path, const char *text)
{
    char *found = text_of(path);
    assert_string_equal(found, text);
    free(found);
}

static void it_takes_its_place_when_it_is_whole(void **state)
{
    (void)state;
    const char *path = in_folder("whole.txt");
    put("whole.txt", "former");
    PartFile part;
    assert_true(part_file_begin(&part, path));
    assert_true(part_file_write(&part, "new", 3));
    expect_text(path, "former");
    assert_int_equal(parts_in_folder(), 1);
    assert_true(part_file_finish(&part));
    expect_text(path, "new");
    assert_true(part_file_begin(&part, path));
    assert_true(fputs("third", part_file_stream(&part)) >= 0);
    assert_true(part_file_finish_synced(&part));
    expect_text(path, "third");
    assert_true(part_file_begin(&part, path));
    part_file_drop(&part);
    part_file_drop(&part);
    expect_text(path, "third");
    assert_int_equal(parts_in_folder(), 0);
}

static void rights_and_owner_stay(void **state)
{
    (void)state;
    static const mode_t modes[] = {0600, 0644, 0640, 0755, 0400, 0666};
    struct stat status;
    mode_t kept = umask(027);
    write_whole(in_folder("fresh"), "x");
    assert_int_equal(stat(in_folder("fresh"), &status), 0);
    assert_int_equal(status.st_mode & 07777, 0640);
    for (size_t i = 0; i < sizeof modes / sizeof *modes; i++) {
        assert_int_equal(chmod(in_folder("fresh"), modes[i]), 0);
        write_whole(in_folder("fresh"), "y");
        assert_int_equal(stat(in_folder("fresh"), &status), 0);
        assert_int_equal(status.st_mode & 07777, modes[i]);
    }
    umask(kept);
    if (geteuid() == 0) {
        assert_int_equal(chown(in_folder("fresh"), 65534, 65534), 0);
        write_whole(in_folder("fresh"), "z");
        assert_int_equal(stat(in_folder("fresh"), &status), 0);
        assert_true(status.st_uid == 65534 && status.st_gid == 65534);
    }
}

// While a private file is written, nobody else can read its new contents.
static void a_private_file_is_private_from_the_start(void **state)
{
    (void)state;
    PartFile part;
    struct stat status;
    put("private", "x");
    assert_int_equal(chmod(in_folder("private"), 0600), 0);
    assert_true(part_file_begin(&part, in_folder("private")));
    assert_int_equal(fstat(part.descriptor, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0600);
    assert_true(fcntl(part.descriptor, F_GETFD) & FD_CLOEXEC);
    part_file_drop(&part);
}

static void its_name_cannot_be_guessed_or_planted(void **state)
{
    (void)state;
    PartFile part[3];
    char guess[300], pid[30];
    put("victim", "kept");
    snprintf(pid, sizeof pid, "%ld", (long)getpid());
    snprintf(guess, sizeof guess, "%s.part-%s", in_folder("aim"), pid);
    assert_int_equal(symlink(in_folder("victim"), guess), 0);
    for (int i = 0; i < 3; i++) {
        assert_true(part_file_begin(&part[i], in_folder("aim")));
        assert_null(strstr(part[i].name, pid));
        for (int k = 0; k < i; k++)
            assert_string_not_equal(part[i].name, part[k].name);
    }
    for (int i = 0; i < 3; i++) {
        assert_true(part_file_write(&part[i], "aim", 3));
        assert_true(part_file_finish(&part[i]));
    }
    expect_text(in_folder("victim"), "kept");
    unlink(guess);
}

static void a_full_disk_leaves_the_former_file(void **state)
{
    (void)state;
    struct rlimit kept, small;
    PartFile part;
    put("full", "former");
    getrlimit(RLIMIT_FSIZE, &kept);
    small = kept;
    small.rlim_cur = 1000;
    signal(SIGXFSZ, SIG_IGN);
    for (int buffered = 0; buffered < 2; buffered++) {
        static const char bytes[5000];
        assert_true(part_file_begin(&part, in_folder("full")));
        setrlimit(RLIMIT_FSIZE, &small);
        bool good = buffered ? fwrite(bytes, 1, 1500, part_file_stream(&part)) == 1500 : part_file_write(&part, bytes, sizeof bytes);
        good = good && part_file_finish_synced(&part);
        setrlimit(RLIMIT_FSIZE, &kept);
        assert_false(good);
        assert_int_equal(errno, EFBIG);
        part_file_drop(&part);
        expect_text(in_folder("full"), "former");
        assert_int_equal(parts_in_folder(), 0);
    }
    assert_false(part_file_begin(&part, "/nowhere/x"));
    assert_int_equal(errno, ENOENT);
}

static void names_may_be_as_long_as_they_get(void **state)
{
    (void)state;
    char name[NAME_MAX + 1], path[600];
    memset(name, 'n', NAME_MAX);
    name[NAME_MAX] = 0;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    write_whole(path, "long");
    expect_text(path, "long");
}

static void remove_and_end(int number)
{
    part_files_remove();
    signal(number, SIG_DFL);
    raise(number);
}

static void a_stop_removes_all_parts(void **state)
{
    (void)state;
    int ready[2];
    assert_int_equal(pipe(ready), 0);
    pid_t child = fork();
    if (child == 0) {
        PartFile part[8];
        signal(SIGTERM, remove_and_end);
        for (int i = 0; i < 8; i++)
            if (!part_file_begin(&part[i], in_folder(i % 2 ? "odd" : "even")) || !part_file_write(&part[i], "half", 4))
                _exit(1);
        part_file_finish(&part[7]);
        if (write(ready[1], "r", 1) != 1)
            _exit(1);
        for (;;)
            pause();
    }
    char byte;
    assert_int_equal(read(ready[0], &byte, 1), 1);
    assert_int_equal(parts_in_folder(), 7);
    kill(child, SIGTERM);
    int status;
    waitpid(child, &status, 0);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
    assert_int_equal(parts_in_folder(), 0);
    expect_text(in_folder("odd"), "half");
    close(ready[0]);
    close(ready[1]);
}

// More temporary files at once than are remembered: only those of an interrupted program would remain.
static void many_parts_at_once(void **state)
{
    (void)state;
    PartFile part[40];
    for (int i = 0; i < 40; i++)
        assert_true(part_file_begin(&part[i], in_folder("many")));
    assert_int_equal(parts_in_folder(), 40);
    for (int i = 0; i < 40; i++)
        part_file_drop(&part[i]);
    assert_int_equal(parts_in_folder(), 0);
    for (int i = 0; i < 100; i++)
        write_whole(in_folder("many"), "again");
}

static void what_is_written_through_is_reported(void **state)
{
    (void)state;
    assert_int_equal(mkfifo(in_folder("fifo"), 0600), 0);
    assert_true(part_file_is_through(in_folder("fifo")));
    assert_true(part_file_is_through("/dev/null"));
    assert_true(part_file_is_through("/dev/stdout"));    // even if it is a regular file: the link would be replaced
    assert_false(part_file_is_through(in_folder("nothing")));
    assert_false(part_file_is_through(folder));
    put("plain", "x");
    assert_false(part_file_is_through(in_folder("plain")));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_takes_its_place_when_it_is_whole),
        cmocka_unit_test(rights_and_owner_stay),
        cmocka_unit_test(a_private_file_is_private_from_the_start),
        cmocka_unit_test(its_name_cannot_be_guessed_or_planted),
        cmocka_unit_test(a_full_disk_leaves_the_former_file),
        cmocka_unit_test(names_may_be_as_long_as_they_get),
        cmocka_unit_test(a_stop_removes_all_parts),
        cmocka_unit_test(many_parts_at_once),
        cmocka_unit_test(what_is_written_through_is_reported),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
