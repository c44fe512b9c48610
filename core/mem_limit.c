#include "core/mem_limit.h"

#include "core/mem_blocks.h"

#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum { MOST_BLOCKS = 2048 };

/* Smaller ones stay on the heap: together they are little. */
static const size_t large = (size_t)1 << 17;
/* What the program, its libraries and threads have beside large blocks. */
static const double program_bytes = 80.0 * 1048576;

typedef struct block {
    char *at;
    size_t bytes;
    bool in_file;
} block;

static struct {
    pthread_mutex_t lock;
    double limit, heap, files; /* bytes */
    int n, n_files;
    bool watched;
    block blocks[MOST_BLOCKS];
} known = {.lock = PTHREAD_MUTEX_INITIALIZER};

/* Without the lock: whether there is anything to look up or to give back. */
static atomic_int n_known, n_in_files;
static _Atomic double trim_above;

void weft_mem_set_limit(double bytes)
{
    pthread_mutex_lock(&known.lock);
    known.limit = bytes > 0 ? bytes : 0;
    atomic_store(&trim_above, 0.85 * known.limit - 8.0 * 1048576);
    pthread_mutex_unlock(&known.lock);
    if (bytes > 0)
        mallopt(M_MMAP_THRESHOLD, (int)large); /* large blocks go back to the system when they are freed */
}

/* ---- what the system says ---- */

double weft_mem_resident(void)
{
    char text[128];
    const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return 0;
    const ssize_t n = read(file, text, sizeof text - 1);
    close(file);
    text[n > 0 ? n : 0] = '\0';
    const char *const second = strchr(text, ' '); /* pages: of the address space, in memory, ... */
    return second ? (double)strtoll(second, NULL, 10) * (double)sysconf(_SC_PAGESIZE) : 0;
}

double weft_mem_peak(void)
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? 1024.0 * (double)usage.ru_maxrss : 0;
}

double weft_mem_in_files(void)
{
    pthread_mutex_lock(&known.lock);
    const double files = known.files;
    pthread_mutex_unlock(&known.lock);
    return files;
}

void weft_mem_give_back(void)
{
    if (atomic_load_explicit(&n_in_files, memory_order_relaxed) == 0 ||
        pthread_mutex_trylock(&known.lock) != 0) /* another thread does it */
        return;
    for (int i = 0; i < known.n; i++)
        if (known.blocks[i].in_file) /* of a shared mapping the file keeps what is taken out of memory */
            madvise(known.blocks[i].at, known.blocks[i].bytes, MADV_DONTNEED);
    pthread_mutex_unlock(&known.lock);
}

void weft_mem_trim(void)
{
    if (atomic_load_explicit(&n_in_files, memory_order_relaxed) > 0 &&
        weft_mem_resident() > atomic_load(&trim_above))
        weft_mem_give_back();
}

/* Serial work on large blocks that does not trim by itself: looks every 2 ms, as long as blocks are in files.
 */
static void *watch(void *unused)
{
    static const struct timespec pause = {.tv_nsec = 2000000};
    bool going = true;
    while (going) {
        weft_mem_trim();
        nanosleep(&pause, NULL);
        pthread_mutex_lock(&known.lock);
        going = known.watched = known.n_files > 0;
        pthread_mutex_unlock(&known.lock);
    }
    return unused;
}

/* The lock is held.  Without a thread the bands still trim. */
static void begin_watch(void)
{
    pthread_t thread;
    if (!known.watched && pthread_create(&thread, NULL, watch, NULL) == 0) {
        pthread_detach(thread);
        known.watched = true;
    }
}

/* ---- blocks ---- */

/* An eighth is kept free for what is not counted. */
static bool fits(double bytes)
{
    return known.heap + bytes <= known.limit - 0.125 * known.limit - program_bytes;
}

weft_mem_place weft_mem_choose_place(size_t bytes)
{
    weft_mem_place place = WEFT_MEM_UNTRACKED;
    if (bytes < large)
        return place;
    pthread_mutex_lock(&known.lock);
    if (known.limit > 0 && known.n < MOST_BLOCKS) {
        place = fits((double)bytes) ? WEFT_MEM_HEAP : WEFT_MEM_FILE;
        known.heap += place == WEFT_MEM_HEAP ? (double)bytes : 0;
    }
    pthread_mutex_unlock(&known.lock);
    if (place == WEFT_MEM_HEAP && weft_mem_resident() + (double)bytes > atomic_load(&trim_above))
        weft_mem_give_back(); /* it is about to be touched as a whole */
    return place;
}

/* The lock is held; there is room unless other threads filled it meanwhile. */
static bool note(void *at, size_t bytes, bool in_file)
{
    if (known.n >= MOST_BLOCKS)
        return false;
    known.blocks[known.n++] = (block){at, bytes, in_file};
    known.n_files += in_file;
    known.files += in_file ? (double)bytes : 0;
    atomic_store(&n_known, known.n);
    atomic_store(&n_in_files, known.n_files);
    if (in_file)
        begin_watch();
    return true;
}

void weft_mem_note_heap(void *at, size_t bytes)
{
    pthread_mutex_lock(&known.lock);
    if (!at || !note(at, bytes, false))
        known.heap -= (double)bytes;
    pthread_mutex_unlock(&known.lock);
}

static int open_nameless(const char *folder)
{
    int file = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file >= 0)
        return file;
    char path[4096]; /* file systems without O_TMPFILE */
    snprintf(path, sizeof path, "%s/weft-XXXXXX", folder);
    file = mkostemp(path, O_CLOEXEC);
    if (file >= 0)
        unlink(path);
    return file;
}

static void *map_new_file(const char *folder, size_t bytes, weft_error *err)
{
    const int file = open_nameless(folder);
    int code = file < 0 ? 1 : posix_fallocate(file, 0, (off_t)bytes);
    void *const at = code == 0 ? mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0) : MAP_FAILED;
    if (file >= 0)
        close(file);
    if (at != MAP_FAILED)
        return at;
    weft_fail(
        err, WEFT_ERR_NOMEM,
        "%s has no room for %.0f MiB that do not fit into memory (free some, let TMPDIR name a folder that "
        "has, or allow more memory)",
        folder, (double)bytes / 1048576);
    return NULL;
}

void *weft_mem_file_alloc(size_t bytes, weft_error *err)
{
    const char *const folder = getenv("TMPDIR");
    void *const at = map_new_file(folder && *folder ? folder : "/var/tmp", bytes, err);
    if (!at)
        return NULL;
    pthread_mutex_lock(&known.lock);
    const bool noted = note(at, bytes, true);
    pthread_mutex_unlock(&known.lock);
    if (noted)
        return at;
    munmap(at, bytes);
    weft_fail(err, WEFT_ERR_NOMEM, "out of memory: more than %d large blocks", MOST_BLOCKS);
    return NULL;
}

/* The lock is held. */
static int find(const void *at)
{
    for (int i = known.n - 1; i >= 0; i--)
        if (known.blocks[i].at == at)
            return i;
    return -1;
}

size_t weft_mem_known_bytes(const void *at)
{
    if (!at || atomic_load(&n_known) == 0)
        return 0;
    pthread_mutex_lock(&known.lock);
    const int i = find(at);
    const size_t bytes = i < 0 ? 0 : known.blocks[i].bytes;
    pthread_mutex_unlock(&known.lock);
    return bytes;
}

bool weft_mem_forget(void *at)
{
    if (!at || atomic_load(&n_known) == 0)
        return false;
    pthread_mutex_lock(&known.lock);
    const int i = find(at);
    const block found = i < 0 ? (block){0} : known.blocks[i];
    if (i >= 0) {
        known.blocks[i] = known.blocks[--known.n];
        known.n_files -= found.in_file;
        known.files -= found.in_file ? (double)found.bytes : 0;
        known.heap -= found.in_file ? 0 : (double)found.bytes;
        atomic_store(&n_known, known.n);
        atomic_store(&n_in_files, known.n_files);
    }
    pthread_mutex_unlock(&known.lock);
    if (found.in_file)
        munmap(found.at, found.bytes);
    return found.in_file;
}
