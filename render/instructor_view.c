#include "render/instructor_view.h"

#include "render/message.h"

#ifdef SELDINGER_INSTRUCTOR
#include <arpa/inet.h>
#include <cJSON.h>
#include <errno.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <png.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double period_s = 0.5, forget_s = 5;    // between pictures; without a request for this long, none is made
enum { CONNECTIONS = 8, IDLE_S = 10, SCREEN = 1000 };    // wider pictures are halved

typedef struct Picture {
    int width, height;
    size_t capacity;
    uint8_t *rgb;
    int64_t number;              // 0: none
} Picture;

struct InstructorView {
    struct MHD_Daemon *server;
    int port;
    // of the window's thread
    Picture drawn;
    int64_t pictures;
    double shown_s;
    // shared, under the lock, which is held only to exchange pointers
    pthread_mutex_t lock;
    Picture ready;
    char *figures;               // JSON; NULL: none yet
    double asked_s;
    // of the server's thread
    Picture front;
    int64_t coded_number;
    void *coded;                 // PNG
    size_t coded_bytes;
};

static const char page[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>Seldinger: live session</title>\n<style>\n"
    ":root{color-scheme:light dark}body{font:16px/1.4 system-ui,sans-serif;margin:0 "
    "auto;max-width:80rem;padding:1rem}img{width:100%;height:auto;background:#111}\n"
    "table{border-collapse:collapse}th{text-align:left;font-weight:400;padding-right:2rem}td{text-align:right;font-variant-numeric:tabular-nums}\n"
    ".notice{border-left:4px solid #b3001b;padding-left:1rem}</style></head>\n<body><h1 id=\"title\">Live session</h1>\n<p id=\"state\" "
    "role=\"status\">connecting</p>\n"
    "<img id=\"view\" alt=\"The trainee's window\"/>\n<table id=\"figures\"></table>\n<p class=\"notice\">For training and research. Not a medical device. "
    "This page only "
    "watches.</p>\n<script src=\"/view.js\"></script></body></html>\n";

static const char script[] =
    "'use strict';\nconst at = id => document.getElementById(id);\nconst rows = [['points', 'Points', 0], ['time_s', 'Time [s]', 0], ['fluoroscopy_s', 'X-ray "
    "time [s]', 1],\n"
    " ['contrast_ml', 'Contrast agent [ml]', 1], ['remaining_mm', 'To the target, along the vessel [mm]', 0], ['wall_force_peak_n', 'Wall force, largest [N]', "
    "2],\n"
    " ['tip_force_peak_n', 'Tip force, largest [N]', 2], ['blind_total_mm', 'Moved without X-rays [mm]', 0], ['error_total', 'Handling errors', 0]];\n"
    "for (const [key, text] of rows) {\n const row = at('figures').insertRow(), head = document.createElement('th');\n head.textContent = text;\n "
    "row.append(head);\n"
    " row.insertCell().id = key;\n}\n"
    "async function refresh() {\n try {\n  const answer = await fetch('/score.json', {cache: 'no-store'});\n  if (answer.ok) {\n   const now = await "
    "answer.json();\n"
    "   at('title').textContent = (now.score.title || 'Free practice') + (now.trainee ? ': ' + now.trainee : '');\n"
    "   at('state').textContent = now.simulated_s.toFixed(1) + ' s, ' + (now.is_paused ? 'paused' : now.score.state);\n"
    "   for (const [key, , digits] of rows) at(key).textContent = now.score[key].toFixed(digits);\n"
    "   at('view').src = '/view.png?' + Math.floor(now.simulated_s * 1000) + '-' + Date.now();\n  }\n"
    " } catch (error) { at('state').textContent = 'the session has ended, or does not answer'; }\n setTimeout(refresh, 500);\n}\nrefresh();\n";

static void picture_swap(Picture *a, Picture *b)
{
    Picture kept = *a;
    *a = *b;
    *b = kept;
}

// --- the server's thread ---

static enum MHD_Result reply(struct MHD_Connection *connection, unsigned status, const char *type, const void *bytes, size_t length)
{
    // the bytes are copied: they may change before a slow reader has them all
    struct MHD_Response *response = MHD_create_response_from_buffer(length, (void *)(uintptr_t)bytes, MHD_RESPMEM_MUST_COPY);
    if (!response)
        return MHD_NO;
    MHD_add_response_header(response, "Content-Type", type);
    MHD_add_response_header(response, "Cache-Control", "no-store");
    MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
    MHD_add_response_header(response, "X-Frame-Options", "DENY");
    MHD_add_response_header(response, "Cross-Origin-Resource-Policy", "same-origin");
    MHD_add_response_header(response, "Content-Security-Policy",
                            "default-src 'none'; img-src 'self'; script-src 'self'; connect-src 'self'; style-src 'unsafe-inline'");
    enum MHD_Result result = MHD_queue_response(connection, status, response);
    MHD_destroy_response(response);
    return result;
}

static enum MHD_Result reply_text(struct MHD_Connection *connection, unsigned status, const char *text)
{
    return reply(connection, status, "text/plain; charset=utf-8", text, strlen(text));
}

// A page of another site cannot read the session by letting its own name lead to this machine.
static bool is_meant(const InstructorView *view, struct MHD_Connection *connection)
{
    char address[32], name[32];
    const char *host = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Host");
    snprintf(address, sizeof address, "127.0.0.1:%d", view->port);
    snprintf(name, sizeof name, "localhost:%d", view->port);
    return host && (!strcmp(host, address) || !strcmp(host, name));
}

static enum MHD_Result reply_figures(InstructorView *view, struct MHD_Connection *connection)
{
    pthread_mutex_lock(&view->lock);
    view->asked_s = clock_s(CLOCK_MONOTONIC);
    char *text = view->figures ? strdup(view->figures) : NULL;
    pthread_mutex_unlock(&view->lock);
    enum MHD_Result result = text ? reply(connection, MHD_HTTP_OK, "application/json", text, strlen(text))
                                  : reply_text(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "no picture yet\n");
    free(text);
    return result;
}

static void halve(Picture *picture)
{
    const int width = picture->width / 2, height = picture->height / 2;
    const size_t row = (size_t)picture->width * 3;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < 3 * width; x++) {
            const uint8_t *from = picture->rgb + (size_t)(2 * y) * row + (size_t)(x / 3 * 6 + x % 3);
            picture->rgb[((size_t)y * (size_t)width) * 3 + (size_t)x] = (uint8_t)((from[0] + from[3] + from[row] + from[row + 3] + 2) / 4);
        }
    picture->width = width;
    picture->height = height;
}

static void encode(InstructorView *view)
{
    png_image image = {.version = PNG_IMAGE_VERSION};
    while (view->front.width > SCREEN)
        halve(&view->front);
    image.width = (png_uint_32)view->front.width;
    image.height = (png_uint_32)view->front.height;
    image.format = PNG_FORMAT_RGB;
    image.flags = PNG_IMAGE_FLAG_FAST;
    free(view->coded);
    view->coded = NULL;
    view->coded_bytes = 0;
    png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
    view->coded = malloc(bytes);
    if (view->coded && png_image_write_to_memory(&image, view->coded, &bytes, 0, view->front.rgb, 0, NULL))
        view->coded_bytes = bytes;
    view->coded_number = view->front.number;
}

static enum MHD_Result reply_picture(InstructorView *view, struct MHD_Connection *connection)
{
    pthread_mutex_lock(&view->lock);
    view->asked_s = clock_s(CLOCK_MONOTONIC);
    if (view->ready.number > view->front.number) {
        picture_swap(&view->ready, &view->front);
        view->ready.number = 0;
    }
    pthread_mutex_unlock(&view->lock);
    if (view->front.number > view->coded_number)
        encode(view);
    if (view->coded_bytes == 0)
        return reply_text(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "no picture yet\n");
    return reply(connection, MHD_HTTP_OK, "image/png", view->coded, view->coded_bytes);
}

static enum MHD_Result answer(void *context, struct MHD_Connection *connection, const char *url, const char *method, const char *version, const char *upload,
                              size_t *upload_bytes, void **state)
{
    InstructorView *view = context;
    (void)version, (void)upload, (void)upload_bytes, (void)state;
    if (strcmp(method, "GET") && strcmp(method, "HEAD"))
        return reply_text(connection, MHD_HTTP_METHOD_NOT_ALLOWED, "this page only watches: GET\n");
    if (!is_meant(view, connection))
        return reply_text(connection, MHD_HTTP_FORBIDDEN, "only for this machine\n");
    if (!strcmp(url, "/"))
        return reply(connection, MHD_HTTP_OK, "text/html; charset=utf-8", page, sizeof page - 1);
    if (!strcmp(url, "/view.js"))
        return reply(connection, MHD_HTTP_OK, "text/javascript; charset=utf-8", script, sizeof script - 1);
    if (!strcmp(url, "/view.png"))
        return reply_picture(view, connection);
    if (!strcmp(url, "/score.json"))
        return reply_figures(view, connection);
    return reply_text(connection, MHD_HTTP_NOT_FOUND, "not here; the page is at /\n");
}

// --- the window's thread ---

// The server's thread takes no signals: they end the window.
static struct MHD_Daemon *start_server(InstructorView *view, int port)
{
    sigset_t all, before;
    const struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    struct MHD_Daemon *server = MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD, (uint16_t)port, NULL, NULL, answer, view, MHD_OPTION_SOCK_ADDR, &address,
                                                 MHD_OPTION_CONNECTION_LIMIT, (unsigned)CONNECTIONS, MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)IDLE_S,
                                                 MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)16384, MHD_OPTION_END);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return server;
}

InstructorView *instructor_view_open(int port, char *message, size_t capacity)
{
    InstructorView *view = calloc(1, sizeof *view);
    if (!view) {
        message_fail(message, capacity, "out of memory for the instructor's view");
        return NULL;
    }
    pthread_mutex_init(&view->lock, NULL);
    view->shown_s = view->asked_s = -1e9;
    view->port = port;
    errno = 0;
    view->server = start_server(view, port);
    const union MHD_DaemonInfo *bound = view->server ? MHD_get_daemon_info(view->server, MHD_DAEMON_INFO_BIND_PORT) : NULL;
    if (bound) {
        view->port = bound->port;
        return view;
    }
    message_fail(message, capacity, "port %d of 127.0.0.1 cannot be opened: %s; give another one", port, errno ? strerror(errno) : "it is in use");
    instructor_view_close(view);
    return NULL;
}

void instructor_view_close(InstructorView *view)
{
    if (!view)
        return;
    if (view->server)
        MHD_stop_daemon(view->server);
    pthread_mutex_destroy(&view->lock);
    free(view->drawn.rgb);
    free(view->ready.rgb);
    free(view->front.rgb);
    free(view->figures);
    free(view->coded);
    free(view);
}

int instructor_view_port(const InstructorView *view) { return view->port; }

bool instructor_view_is_due(InstructorView *view)
{
    const double now = view ? clock_s(CLOCK_MONOTONIC) : 0;
    if (!view || now - view->shown_s < period_s || pthread_mutex_trylock(&view->lock) != 0)
        return false;
    bool is_asked = now - view->asked_s < forget_s;
    pthread_mutex_unlock(&view->lock);
    return is_asked;
}

uint8_t *instructor_view_pixels(InstructorView *view, int width, int height)
{
    Picture *drawn = &view->drawn;
    const size_t bytes = (size_t)width * (size_t)height * 3;
    if (bytes > drawn->capacity) {
        uint8_t *more = realloc(drawn->rgb, bytes);
        if (!more)
            return NULL;
        drawn->rgb = more;
        drawn->capacity = bytes;
    }
    drawn->width = width;
    drawn->height = height;
    return drawn->rgb;
}

static char *print_figures(const InstructorFigures *figures)
{
    cJSON *root = cJSON_CreateObject();
    char *score = root ? score_json(figures->score, figures->scene) : NULL;
    bool good = score && cJSON_AddStringToObject(root, "trainee", figures->trainee) && cJSON_AddNumberToObject(root, "simulated_s", figures->simulated_s) &&
                cJSON_AddBoolToObject(root, "is_paused", figures->is_paused) && cJSON_AddRawToObject(root, "score", score);
    char *text = good ? cJSON_PrintUnformatted(root) : NULL;
    free(score);
    cJSON_Delete(root);
    return text;
}

void instructor_view_show(InstructorView *view, const InstructorFigures *figures)
{
    char *text = print_figures(figures);
    view->shown_s = clock_s(CLOCK_MONOTONIC);
    view->drawn.number = ++view->pictures;
    if (pthread_mutex_trylock(&view->lock) == 0) {
        char *older = view->figures;
        picture_swap(&view->drawn, &view->ready);
        view->figures = text ? text : older;
        text = text ? older : NULL;
        pthread_mutex_unlock(&view->lock);
    }
    free(text);
}

#else
InstructorView *instructor_view_open(int port, char *message, size_t capacity)
{
    (void)port;
    message_fail(message, capacity, "this build has no instructor's view: libmicrohttpd-dev was not installed");
    return NULL;
}

void instructor_view_close(InstructorView *view) { (void)view; }
int instructor_view_port(const InstructorView *view) { return view ? 0 : -1; }
bool instructor_view_is_due(InstructorView *view) { return view != NULL; }
uint8_t *instructor_view_pixels(InstructorView *view, int width, int height) { return (void)view, (void)width, (void)height, NULL; }
void instructor_view_show(InstructorView *view, const InstructorFigures *figures) { (void)view, (void)figures; }
#endif
