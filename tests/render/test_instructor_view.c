// The instructor's view as a browser and as hostile clients see it: its pages, requests that are none, slow readers, too many connections and broken ones; and what
// handing over a picture costs the window meanwhile.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/instructor_view.h"

#include <arpa/inet.h>
#include <cJSON.h>
#include <netinet/in.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { WIDTH = 1280, HEIGHT = 720 };

static InstructorView *view;
static Scene *scene;
static ScoreFigures score;

static int open_view(void **state)
{
    (void)state;
    static const char text[] =
        "seldinger: 1\nvessel: {plane: {point_mm: [0, 0, 0], normal: [0, 0, 1]}}\n"
        "wire: {sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 80}]}\nrig: {start_mm: [0, 0, 5], direction: [1, 0, 0]}\n";
    static Faults faults;
    char message[256] = "";
    scene = scene_parse(text, strlen(text), "a.yaml", &faults);
    if (!scene)
        fail_msg("%s", faults.text[0]);
    view = instructor_view_open(0, message, sizeof message);
    if (!view && strstr(message, "libmicrohttpd"))
        return 0;
    assert_non_null(view);
    score.points = 41.5;
    return 0;
}

static int close_view(void **state)
{
    (void)state;
    instructor_view_close(view);
    scene_free(scene);
    return 0;
}

static void need_view(void)
{
    if (view)
        return;
    print_message("skipped: built without libmicrohttpd\n");
    skip();
}

static void pause_ms(int ms) { nanosleep(&(struct timespec){.tv_nsec = ms * 1000000L}, NULL); }

static int connect_to(void)
{
    const struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)instructor_view_port(view)), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const struct timeval patience = {.tv_sec = 5};
    int at = socket(AF_INET, SOCK_STREAM, 0);
    assert_true(at >= 0);
    setsockopt(at, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    assert_int_equal(connect(at, (const struct sockaddr *)&address, sizeof address), 0);
    return at;
}

// Sends the text and reads until the other side closes; the caller frees. *length without the NUL.
static char *exchange(const void *text, size_t bytes, size_t *length)
{
    static const size_t most = 8 << 20;
    char *all = malloc(most + 1);
    int at = connect_to();
    *length = 0;
    (void)!send(at, text, bytes, MSG_NOSIGNAL);
    shutdown(at, SHUT_WR);
    for (ssize_t got; *length < most && (got = recv(at, all + *length, most - *length, 0)) > 0;)
        *length += (size_t)got;
    close(at);
    all[*length] = 0;
    return all;
}

static char *get(const char *method, const char *path, const char *host, size_t *length)
{
    char request[400];
    int bytes = snprintf(request, sizeof request, "%s %s HTTP/1.1\r\nHost: %s:%d\r\nConnection: close\r\n\r\n", method, path, host, instructor_view_port(view));
    return exchange(request, (size_t)bytes, length);
}

static int status_of(const char *method, const char *path, const char *host)
{
    size_t length;
    char *reply = get(method, path, host, &length);
    int status = 0;
    (void)!sscanf(reply, "HTTP/1.1 %d", &status);
    free(reply);
    return status;
}

static void show_picture(uint8_t grey)
{
    assert_int_equal(status_of("GET", "/score.json", "127.0.0.1") == 0, 0);      // somebody asks
    for (int i = 0; i < 400 && !instructor_view_is_due(view); i++)
        pause_ms(5);
    assert_true(instructor_view_is_due(view));
    uint8_t *rgb = instructor_view_pixels(view, WIDTH, HEIGHT);
    assert_non_null(rgb);
    memset(rgb, grey, (size_t)3 * WIDTH * HEIGHT);
    instructor_view_show(view, &(InstructorFigures){"Ada <b>\"", 12.25, false, &score, scene});
    assert_false(instructor_view_is_due(view));                                  // not twice at once
}

static void a_browser_sees_picture_and_score(void **state)
{
    (void)state;
    need_view();
    size_t length;
    assert_false(instructor_view_is_due(NULL));
    assert_false(instructor_view_is_due(view));                                  // nobody looks
    assert_int_equal(status_of("GET", "/view.png", "127.0.0.1"), 503);           // nothing to show yet
    show_picture(77);
    char *reply = get("GET", "/view.png", "localhost", &length), *body = strstr(reply, "\r\n\r\n") + 4;
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_memory(&image, body, length - (size_t)(body - reply)));
    assert_int_equal(image.width, WIDTH / 2);
    assert_int_equal(image.height, HEIGHT / 2);
    image.format = PNG_FORMAT_RGB;
    uint8_t *rgb = malloc(PNG_IMAGE_SIZE(image));
    assert_true(png_image_finish_read(&image, NULL, rgb, 0, NULL));
    for (size_t i = 0; i < PNG_IMAGE_SIZE(image); i++)
        assert_int_equal(rgb[i], 77);
    free(rgb);
    free(reply);
    reply = get("GET", "/score.json", "127.0.0.1", &length);
    cJSON *json = cJSON_Parse(strstr(reply, "\r\n\r\n") + 4);
    assert_non_null(json);
    assert_string_equal(cJSON_GetObjectItem(json, "trainee")->valuestring, "Ada <b>\"");
    assert_true(cJSON_GetObjectItem(json, "simulated_s")->valuedouble == 12.25);
    assert_true(cJSON_GetObjectItem(cJSON_GetObjectItem(json, "score"), "points")->valuedouble == 41.5);
    cJSON_Delete(json);
    free(reply);
    reply = get("GET", "/", "127.0.0.1", &length);
    assert_non_null(strstr(reply, "HTTP/1.1 200"));
    assert_non_null(strstr(reply, "Content-Security-Policy: default-src 'none'"));
    assert_null(strstr(reply, "http://"));                                       // nothing from elsewhere
    assert_null(strstr(reply, "https://"));
    free(reply);
    assert_int_equal(status_of("GET", "/view.js", "127.0.0.1"), 200);
    assert_int_equal(status_of("HEAD", "/", "127.0.0.1"), 200);
}

static void what_is_no_request_of_the_page_is_refused(void **state)
{
    (void)state;
    need_view();
    assert_int_equal(status_of("GET", "/../etc/passwd", "127.0.0.1"), 404);
    assert_int_equal(status_of("GET", "/score.json/", "127.0.0.1"), 404);
    assert_int_equal(status_of("POST", "/score.json", "127.0.0.1"), 405);
    assert_int_equal(status_of("PUT", "/", "127.0.0.1"), 405);
    assert_int_equal(status_of("GET", "/", "elsewhere.example"), 403);           // another site's name that leads here
    // bytes at random, and every prefix of a request: the server answers the next request all the same
    static const char request[] = "GET /score.json HTTP/1.1\r\nHost: 127.0.0.1\r\nX: y\r\n\r\n";
    unsigned seed = 9;
    size_t length;
    for (size_t n = 0; n <= sizeof request - 1; n += 3)
        free(exchange(request, n, &length));
    for (int i = 0; i < 200; i++) {
        uint8_t bytes[700];
        size_t count = seed % sizeof bytes;
        for (size_t k = 0; k < count; k++)
            bytes[k] = (uint8_t)((seed = seed * 1664525 + 1013904223) >> 24);
        if (i % 2)
            memcpy(bytes, request, count < 40 ? count : 40);
        free(exchange(bytes, count, &length));
        seed = seed * 1664525 + 1013904223;
    }
    char *large = malloc(100000);
    memset(large, 'a', 100000);
    memcpy(large, "GET /", 5);
    free(exchange(large, 100000, &length));
    free(large);
    assert_int_equal(status_of("GET", "/", "127.0.0.1"), 200);
}

// Clients that ask for a picture and read nothing, or say nothing at all, neither stop the window nor, once gone, the others.
static void slow_clients_stop_nobody(void **state)
{
    (void)state;
    need_view();
    enum { CLIENTS = 20 };
    int client[CLIENTS];
    char request[200];
    show_picture(10);
    int bytes = snprintf(request, sizeof request, "GET /view.png HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", instructor_view_port(view));
    for (int i = 0; i < CLIENTS; i++) {
        client[i] = connect_to();
        for (int k = 0; i % 2 && k < 50; k++)
            (void)!send(client[i], request, (size_t)bytes, MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    double longest = 0;
    for (int i = 0; i < 20; i++) {
        double begun = clock_s(CLOCK_MONOTONIC);
        instructor_view_is_due(view);
        assert_non_null(instructor_view_pixels(view, WIDTH, HEIGHT));
        instructor_view_show(view, &(InstructorFigures){"Ada", i, false, &score, scene});
        longest = fmax(longest, clock_s(CLOCK_MONOTONIC) - begun);
        pause_ms(2);
    }
    print_message("longest hand-over of a picture: %.3f ms\n", 1000 * longest);
    assert_true(longest < 0.1);          // it waits for nobody; a loaded machine may interrupt it
    for (int i = 0; i < CLIENTS; i++) {
        const struct linger abort_it = {.l_onoff = i % 3 == 0};
        setsockopt(client[i], SOL_SOCKET, SO_LINGER, &abort_it, sizeof abort_it);
        close(client[i]);
    }
    int status = 0;
    for (int i = 0; i < 100 && status != 200; i++, pause_ms(20))
        status = status_of("GET", "/", "127.0.0.1");
    assert_int_equal(status, 200);
}

// The socket listens on the loopback address alone.
static void other_machines_cannot_connect(void **state)
{
    (void)state;
    need_view();
    char line[300], here[40];
    FILE *file = fopen("/proc/net/tcp", "r");
    assert_non_null(file);
    snprintf(here, sizeof here, ":%04X 00000000:0000 0A", (unsigned)instructor_view_port(view));
    int listening = 0;
    while (fgets(line, sizeof line, file))
        if (strstr(line, here)) {
            assert_non_null(strstr(line, " 0100007F:"));
            listening++;
        }
    fclose(file);
    assert_int_equal(listening, 1);
    char message[256] = "";
    assert_null(instructor_view_open(instructor_view_port(view), message, sizeof message));
    assert_non_null(strstr(message, "cannot be opened"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_browser_sees_picture_and_score), cmocka_unit_test(what_is_no_request_of_the_page_is_refused),
                                       cmocka_unit_test(slow_clients_stop_nobody), cmocka_unit_test(other_machines_cannot_connect)};
    return cmocka_run_group_tests(tests, open_view, close_view);
}
