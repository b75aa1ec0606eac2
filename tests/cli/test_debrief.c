// Debriefing as a user does it: `seldinger replay --beside` under a virtual X server, with another recording and with the script of a hand, and keys by xdotool. And a
// running session as a browser on this machine sees it: `nav --instructor-port`.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>

static char folder[] = "/tmp/seldinger-debrief-XXXXXX";
#include "display.h"
#include "tests/folder.h"

#define SCENE                                                                                                                                                  \
    "seldinger: 1\nvessel: {tube: {radius_mm: 1.2, normal: [0, 1, 0], path: [{line_mm: 15}, {arc: {radius_mm: 20, angle_deg: 60}}, {line_mm: 10}]}, "          \
    "contact: tube, friction: 0.05}\nwire: {elements: 20, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"                            \
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\ntargets: [{name: end, point_mm: [15, 0, 0], radius_mm: 2}]\n"                        \
    "exercise: {title: Along, target: end, hold_s: 0.2, rules: {wall_force_n: 0.0001}}\n"

static int run(const char *command)
{
    char text[1500];
    snprintf(text, sizeof text, "cd '%s' && S='%s' && %s", folder, SELDINGER_PROGRAM, command);
    int status = system(text);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int set_up(void **state)
{
    if (make_folder(state) != 0 || display_start() != 0)
        return -1;
    put("scene.yaml", SCENE);
    put("hand.csv", "t_s,push_mm_s,twist_deg_s\n0.2,30,0\n0.6,0,0\n1,0,0\n");
    put("slow.csv", "t_s,push_mm_s,twist_deg_s\n0.5,15,0\n1.2,0,0\n1.5,0,0\n");
    put("broken.csv", "t_s,push_mm_s,twist_deg_s\nfast,1,0\n");
    return run("for h in hand slow; do \"$S\" run scene.yaml --script $h.csv --record $h.h5 --quiet || exit 1; done");
}

static int tear_down(void **state)
{
    display_stop();
    return remove_folder(state);
}

static void what_cannot_be_shown_beside_is_reported(void **state)
{
    (void)state;
    assert_int_equal(run("\"$S\" replay slow.h5 --beside nosuch.h5 --quiet 2>out.txt"), 2);
    assert_int_equal(run("grep -q nosuch.h5 out.txt"), 0);
    assert_int_equal(run("\"$S\" replay slow.h5 --beside broken.csv --quiet 2>out.txt"), 2);
    assert_int_equal(run("grep -q broken.csv:2 out.txt"), 0);
    assert_int_equal(run("\"$S\" replay slow.h5 --picture hand.h5 --beside hand.h5 --quiet 2>out.txt"), 2);
    assert_int_equal(run("grep -q -e --beside out.txt"), 0);
}

// Keys go to the window until it closes; it must end well whatever was pressed.
static void recordings_and_scripts_run_side_by_side(void **state)
{
    (void)state;
    need_display();
    static const char *const beside[] = {"hand.h5", "hand.csv"};
    for (int i = 0; i < 2; i++) {
        char command[600];
        snprintf(command, sizeof command,
                 "{ \"$S\" replay slow.h5 --beside %s --duration-s 6 --size 640x480 --quiet >out.txt 2>&1 & p=$!; "
                 "while kill -0 $p 2>/dev/null; do xdotool search --name 'Seldinger replay' >/dev/null 2>&1 && "
                 "xdotool key Down Down y 9 greater Right ctrl+Left Up 6 8 5 9 p less; sleep 0.3; done; wait $p; }",
                 beside[i]);
        assert_int_equal(run(command), 0);
        assert_int_equal(run("! grep . out.txt"), 0);
    }
    assert_int_equal(run("! ls -d /tmp/seldinger-beside-* 2>/dev/null"), 0);
}

// A socket bound to a free port of 127.0.0.1; nobody else can have the port while it is open.
static int bind_port(int *port)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof address;
    int at = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(bind(at, (const struct sockaddr *)&address, size), 0);
    assert_int_equal(listen(at, 1), 0);
    assert_int_equal(getsockname(at, (struct sockaddr *)&address, &size), 0);
    *port = ntohs(address.sin_port);
    return at;
}

// Whether GET `path` is answered with status 200 and a body that begins with `begin`.
static bool answers(int port, const char *path, const char *begin)
{
    char request[200], reply[4096] = "";
    const struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const struct timeval patience = {.tv_sec = 5};
    int at = socket(AF_INET, SOCK_STREAM, 0), bytes;
    setsockopt(at, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    bytes = snprintf(request, sizeof request, "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nConnection: close\r\n\r\n", path, port);
    size_t length = 0;
    if (connect(at, (const struct sockaddr *)&address, sizeof address) == 0 && send(at, request, (size_t)bytes, MSG_NOSIGNAL) == bytes)
        for (ssize_t got; length + 1 < sizeof reply && (got = recv(at, reply + length, sizeof reply - 1 - length, 0)) > 0;)
            length += (size_t)got;
    close(at);
    const char *body = strstr(reply, "\r\n\r\n");
    return !strncmp(reply, "HTTP/1.1 200", 12) && body && !strncmp(body + 4, begin, strlen(begin));
}

static void an_instructor_watches_the_session(void **state)
{
    (void)state;
    need_display();
    char command[600];
    int port, taken = bind_port(&port);
    snprintf(command, sizeof command, "\"$S\" nav scene.yaml --no-record --instructor-port %d --quiet 2>out.txt", port);
    assert_int_equal(run(command), 2);
    if (run("grep -q libmicrohttpd out.txt") == 0) {
        print_message("skipped: built without libmicrohttpd\n");
        skip();
    }
    assert_int_equal(run("grep -q 'cannot be opened' out.txt"), 0);      // another program has the port
    close(taken);
    snprintf(command, sizeof command,
             "{ \"$S\" nav scene.yaml --no-record --trainee Ada --instructor-port %d --duration-s 12 --size 640x480 --quiet; echo $?; } >end.txt 2>&1 &", port);
    assert_int_equal(run(command), 0);
    bool has_score = false, has_picture = false;
    for (int i = 0; i < 300 && !(has_score && has_picture); i++) {
        has_score = has_score || answers(port, "/score.json", "{\"trainee\":\"Ada\"");
        has_picture = has_picture || answers(port, "/view.png", "\x89PNG");
        nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
    }
    assert_true(has_score && has_picture);
    for (int i = 0; i < 400 && run("[ -s end.txt ]") != 0; i++)
        nanosleep(&(struct timespec){.tv_nsec = 100000000}, NULL);
    char *end = text_of(in_folder("end.txt"));
    assert_string_equal(end, "0\n");
    free(end);
    assert_false(answers(port, "/", ""));                                // it goes with the session
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_cannot_be_shown_beside_is_reported), cmocka_unit_test(recordings_and_scripts_run_side_by_side),
                                       cmocka_unit_test(an_instructor_watches_the_session)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
