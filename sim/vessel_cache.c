#include "sim/vessel_cache.h"

#include "base/base.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { KEY = 65 };

struct SharedVessel {
    SharedVessel *next;
    char key[KEY];
    OpenVessel open;
    bool is_costly;          // read from a file or fitted; exact walls, and what is sampled from them, are made again at once
    int holders;
    unsigned long used;      // when a scene last asked for it or left it
};

// No allocation takes place under the lock: if it failed, the call would end there (base/heap.h).
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static SharedVessel *first;
static unsigned long asked;

const OpenVessel *shared_vessel(const SharedVessel *shared) { return &shared->open; }

// --- what makes two vessels the same ---

static void add_text(Sha256 *sha, const char *text) { sha256_add(sha, text ? text : "", text ? strlen(text) + 1 : 1); }

// A file that is missing is left to its reader.
static void add_file(Sha256 *sha, const char *path)
{
    struct stat file;
    add_text(sha, path);
    if (!path || stat(path, &file) != 0)
        return;
    int64_t identity[] = {(int64_t)file.st_dev, (int64_t)file.st_ino, file.st_size,        file.st_mtim.tv_sec,
                          file.st_mtim.tv_nsec, file.st_ctim.tv_sec,  file.st_ctim.tv_nsec};
    sha256_add(sha, identity, sizeof identity);
}

// All that open_vessel() reads of a scene but the place where a tool enters a mesh. Arrays of numbers have no padding; structures are added by their members.
static void make_key(const Scene *scene, char key[KEY])
{
    Sha256 sha;
    const TubeOptions *tube = &scene->tube;
    int whole[] = {(int)scene->source, (int)scene->contact, scene->shape_option_count, tube->piece_count,
                   tube->point_count,  tube->closed_ends,   scene->wire.has_sheath};
    double number[] = {tube->start.x,        tube->start.y,         tube->start.z,         tube->direction.x,     tube->direction.y,    tube->direction.z,
                       tube->normal.x,       tube->normal.y,        tube->normal.z,        tube->radius,          scene->plane_point.x, scene->plane_point.y,
                       scene->plane_point.z, scene->plane_normal.x, scene->plane_normal.y, scene->plane_normal.z, scene->mesh_scale,    scene->mesh_cell};
    sha256_begin(&sha);
    sha256_add(&sha, whole, sizeof whole);
    sha256_add(&sha, number, sizeof number);
    add_file(&sha, scene->model_path);
    add_file(&sha, scene->mesh_path);
    add_text(&sha, scene->tube_points_path);
    add_text(&sha, scene->shape_name);
    for (int i = 0; i < scene->shape_option_count; i++) {
        add_text(&sha, scene->shape_option[i][0]);
        add_text(&sha, scene->shape_option[i][1]);
    }
    for (int i = 0; i < tube->piece_count; i++) {
        const TubePiece *piece = &tube->piece[i];
        double of_piece[] = {piece->length, piece->arc_radius, piece->angle, piece->plane};
        sha256_add(&sha, of_piece, sizeof of_piece);
    }
    for (int i = 0; i < tube->point_count; i++)
        sha256_add(&sha, (double[3]){tube->point[i].x, tube->point[i].y, tube->point[i].z}, 3 * sizeof(double));
    sha256_end(&sha, key);
}

// --- the list; under the lock ---

static SharedVessel *find(const char *key)
{
    SharedVessel *shared = first;
    while (shared && strcmp(shared->key, key) != 0)
        shared = shared->next;
    return shared;
}

static SharedVessel *hold(SharedVessel *shared)
{
    if (shared) {
        shared->holders++;
        shared->used = ++asked;
    }
    return shared;
}

// Takes an idle one out of the list: one that costs little, or the longest unused of more than `most`. NULL: there are no more.
static SharedVessel *take_idle(int most)
{
    SharedVessel **oldest = NULL;
    int idle = 0;
    bool is_due = false;
    for (SharedVessel **at = &first; *at && !is_due; at = &(*at)->next) {
        if ((*at)->holders > 0)
            continue;
        idle++;
        is_due = !(*at)->is_costly;
        if (is_due || !oldest || (*at)->used < (*oldest)->used)
            oldest = at;
    }
    if (!is_due && idle <= most)
        return NULL;
    SharedVessel *taken = *oldest;
    *oldest = taken->next;
    return taken;
}

// --- for scenes ---

static void close_shared(SharedVessel *shared)
{
    open_vessel_close(&shared->open);
    free(shared);
}

static void keep_idle(int most)
{
    for (SharedVessel *old = NULL;;) {
        pthread_mutex_lock(&lock);
        old = take_idle(most);
        pthread_mutex_unlock(&lock);
        if (!old)
            return;
        close_shared(old);
    }
}

static void leave(SharedVessel *shared)
{
    pthread_mutex_lock(&lock);
    shared->holders--;
    shared->used = ++asked;
    pthread_mutex_unlock(&lock);
}

static SharedVessel *find_held(const char *key)
{
    pthread_mutex_lock(&lock);
    SharedVessel *shared = hold(find(key));
    pthread_mutex_unlock(&lock);
    return shared;
}

// Another thread may have opened the same vessel in the meantime: then that one is taken.
static SharedVessel *share(SharedVessel *mine)
{
    pthread_mutex_lock(&lock);
    SharedVessel *other = hold(find(mine->key));
    if (!other) {
        mine->next = first;
        mine->used = ++asked;
        first = mine;
    }
    pthread_mutex_unlock(&lock);
    if (!other)
        return mine;
    close_shared(mine);
    return other;
}

SharedVessel *vessel_cache_open(const Scene *scene, const OpenVesselOptions *options, Faults *faults)
{
    char key[KEY];
    make_key(scene, key);
    SharedVessel *shared = find_held(key);
    if (shared && open_vessel_holds_entry(scene, &shared->open, faults))
        return shared;
    if (shared) {
        leave(shared);
        return NULL;
    }
    shared = HEAP_ZEROED(1, sizeof *shared);
    shared->holders = 1;
    memcpy(shared->key, key, KEY);
    if (!open_vessel(scene, options, &shared->open, faults)) {
        close_shared(shared);
        return NULL;
    }
    shared->is_costly = shared->open.tree || scene->source == SOURCE_MESH;
    return share(shared);
}

void vessel_cache_release(SharedVessel *shared, int idle_most)
{
    if (shared)
        leave(shared);
    keep_idle(idle_most);
}

void vessel_cache_forget(void) { keep_idle(0); }
