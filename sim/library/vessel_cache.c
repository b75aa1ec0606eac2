#include "sim/library/vessel_cache.h"

#include "base/base.h"
#include "seldinger/scene.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { IDLE_MOST = 4, KEY_SIZE = 4096 + 256 };

struct SharedVessel {
    SharedVessel *next;
    char *key;               // NULL: not in the list
    OpenVessel open;
    int holders;
    unsigned long used;      // when a scene last asked for it or left it
};

// No allocation takes place under the lock: if it failed, the call would end there (base/heap.h).
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static SharedVessel *first;
static unsigned long asked;

const OpenVessel *shared_vessel(const SharedVessel *shared) { return &shared->open; }

// --- what makes two vessels the same ---

static size_t shape_key(const Scene *scene, char *key, size_t size)
{
    size_t length = (size_t)snprintf(key, size, "%s", scene->shape_name);
    for (int i = 0; i < scene->shape_option_count && length < size; i++)
        length += (size_t)snprintf(key + length, size - length, "|%s=%s", scene->shape_option[i][0], scene->shape_option[i][1]);
    return length;
}

static size_t file_key(const char *path, char *key, size_t size)
{
    struct stat file;
    if (stat(path, &file) != 0)
        return size;
    return (size_t)snprintf(key, size, "%s|%llu|%llu|%lld|%lld.%09ld|%lld.%09ld", path, (unsigned long long)file.st_dev, (unsigned long long)file.st_ino,
                            (long long)file.st_size, (long long)file.st_mtim.tv_sec, file.st_mtim.tv_nsec, (long long)file.st_ctim.tv_sec,
                            file.st_ctim.tv_nsec);
}

// Returns false if the vessel cannot be shared.
static bool write_key(const Scene *scene, char key[KEY_SIZE])
{
    bool is_file = scene->source == SOURCE_MODEL || scene->source == SOURCE_MESH;
    if (!is_file && scene->source != SOURCE_SHAPE)
        return false;
    size_t length = (size_t)snprintf(key, KEY_SIZE, "%d|%d|%a|%a|", (int)scene->source, (int)scene->contact, scene->mesh_scale, scene->mesh_cell);
    length += is_file ? file_key(scene_needed_file(scene), key + length, KEY_SIZE - length) : shape_key(scene, key + length, KEY_SIZE - length);
    return length < KEY_SIZE;
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

// Takes the longest unused of more than `most` idle ones out of the list; NULL: there are no more.
static SharedVessel *take_idle(int most)
{
    SharedVessel **oldest = NULL;
    int idle = 0;
    for (SharedVessel **at = &first; *at; at = &(*at)->next) {
        if ((*at)->holders > 0)
            continue;
        idle++;
        if (!oldest || (*at)->used < (*oldest)->used)
            oldest = at;
    }
    if (idle <= most)
        return NULL;
    SharedVessel *taken = *oldest;
    *oldest = taken->next;
    return taken;
}

// --- for scenes ---

static void close_shared(SharedVessel *shared)
{
    open_vessel_close(&shared->open);
    free(shared->key);
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
    char key[KEY_SIZE];
    bool can_be_shared = write_key(scene, key);
    SharedVessel *shared = can_be_shared ? find_held(key) : NULL;
    if (shared && !open_vessel_holds_entry(scene, &shared->open, faults)) {
        vessel_cache_release(shared);
        return NULL;
    }
    if (shared)
        return shared;
    shared = HEAP_ZEROED(1, sizeof *shared);
    shared->holders = 1;
    shared->key = can_be_shared ? HEAP_TEXT(key) : NULL;
    if (!open_vessel(scene, options, &shared->open, faults)) {
        close_shared(shared);
        return NULL;
    }
    return can_be_shared ? share(shared) : shared;
}

void vessel_cache_release(SharedVessel *shared)
{
    if (shared && !shared->key) {
        close_shared(shared);
        return;
    }
    pthread_mutex_lock(&lock);
    if (shared) {
        shared->holders--;
        shared->used = ++asked;
    }
    pthread_mutex_unlock(&lock);
    keep_idle(IDLE_MOST);
}

void sel_vessels_forget(void) { keep_idle(0); }
