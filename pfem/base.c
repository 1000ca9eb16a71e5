/** @file base.c
 * Status passing, memory, text, hashing, random numbers and the clock.
 */
#include "base.h"

#include <malloc.h>
#include <stdint.h>
#include <sys/mman.h>
#include <time.h>

#define LARGE ((size_t)1 << 18) // bytes of an array from which it is to lie on pages of 2 MB
#define APART ((size_t)1 << 17) // bytes from which an array that lasts is kept out of the heap
#define MANY 16384              // items
#define HEAP_MOST (32 << 20)    // bytes up to which what is needed for a moment comes from the heap: new pages cost 0.4 ns a byte

silt_status silt_fail(silt_error *err, silt_status status, const char *format, ...) {
    if (!err)
        return status;
    va_list list;
    va_start(list, format);
    // format into a copy: an argument may be the old text of err itself
    char text[sizeof err->text];
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    memcpy(err->text, text, strlen(text) + 1);
    err->status = status;
    err->count = 1;
    return status;
}

// the only place where the library ends the program: there is no memory left to say anything better
static void memory_exhausted(size_t n, size_t size) {
    fprintf(stderr, "silt: out of memory: %zu items of %zu bytes were asked for\n", n, size);
    abort();
}

// Large pages: a step looks fewer addresses up, by 5 % of its time at 40k nodes and 7 % at 160k. From the page that the array begins
// on, so that arrays beside each other share them. A wish, no more.
static void large_pages(void *data, size_t bytes) {
    const uintptr_t page = 4096, begin = (uintptr_t)data / page * page, end = ((uintptr_t)data + bytes) / page * page;
    if (bytes >= LARGE)
        madvise((void *)begin, end - begin, MADV_HUGEPAGE);
}

static bool memory_settled;

void silt_memory_settle(void) {
    memory_settled = mallopt(M_MMAP_THRESHOLD, HEAP_MOST) && mallopt(M_TRIM_THRESHOLD, INT32_MAX);
}

// From the system itself: there is no hole in the heap where it was, and pages that nobody has written to take no memory.
static void *apart(size_t bytes) {
    if (memory_settled && bytes >= APART)
        mallopt(M_MMAP_THRESHOLD, APART);
    void *data = calloc(1, bytes ? bytes : 1);
    if (memory_settled && bytes >= APART)
        mallopt(M_MMAP_THRESHOLD, HEAP_MOST);
    if (data)
        large_pages(data, bytes);
    return data;
}

void *silt_alloc(size_t n, size_t size) {
    void *data = calloc(n ? n : 1, size ? size : 1);
    if (!data)
        memory_exhausted(n, size);
    large_pages(data, n * size);
    return data;
}

void *silt_room(void *data, size_t *capacity, size_t need, size_t size) {
    if (need <= *capacity)
        return data;
    free(data);
    *capacity = need + need / 8;
    data = apart(*capacity * size);
    if (!data)
        memory_exhausted(*capacity, size);
    return data;
}

// Lent memory: blocks one on the other, each behind a header that knows the one below. What is needed goes where it fits among those that
// are free again, else on top.
typedef struct header {
    size_t below, bytes;
    bool free;
} header;
#define HEADER ((size_t)64) // bytes, so that what follows begins on a line of the cache
static _Thread_local struct {
    char *data;
    size_t bytes, used, last;
} lent;

void silt_lend(void *data, size_t bytes) {
    const size_t skip = (HEADER - (uintptr_t)data % HEADER) % HEADER;
    const bool any = data && bytes > skip;
    lent.data = any ? (char *)data + skip : NULL;
    lent.bytes = any ? bytes - skip : 0;
    lent.used = lent.last = 0;
}

bool silt_borrowed(const void *data) {
    const uintptr_t at = (uintptr_t)data, begin = (uintptr_t)lent.data;
    return begin && at >= begin && at < begin + lent.bytes;
}

void *silt_borrow(size_t n, size_t size) {
    size_t bytes;
    if (__builtin_mul_overflow(n ? n : 1, size ? size : 1, &bytes) || bytes > lent.bytes)
        return silt_alloc(n, size);
    bytes = (bytes + HEADER - 1) / HEADER * HEADER;
    size_t at = 0;
    header *block = (header *)(void *)lent.data;
    while (at < lent.used && !(block->free && block->bytes >= bytes)) {
        at += HEADER + block->bytes;
        block = (header *)(void *)(lent.data + at);
    }
    if (at + HEADER + bytes > lent.bytes)
        return silt_alloc(n, size);
    if (at == lent.used) {
        *block = (header){.below = lent.last, .bytes = bytes};
        lent.last = at;
        lent.used += HEADER + bytes;
    }
    block->free = false;
    return memset((char *)block + HEADER, 0, bytes);
}

void silt_return(void *data) {
    if (!silt_borrowed(data)) {
        free(data);
        return;
    }
    ((header *)(void *)((char *)data - HEADER))->free = true;
    for (const header *top; lent.used && (top = (const header *)(void *)(lent.data + lent.last))->free;) {
        lent.used = lent.last;
        lent.last = top->below;
    }
}

void *silt_grow(void *data, int *capacity, int need, size_t size) {
    if (need <= *capacity)
        return data;
    // Half more than before, so that pushing one by one costs a constant each; of many an eighth, since room is memory. Not by the size of an item:
    // arrays that share a capacity grow alike.
    int64_t wanted = (int64_t)*capacity + *capacity / (*capacity < MANY ? 2 : 8) + 8;
    if (wanted < need)
        wanted = need;
    if (wanted > INT32_MAX)
        wanted = INT32_MAX;
    size_t bytes = 0;
    const size_t old = (size_t)*capacity * size;
    void *grown = NULL;
    const bool fits = !__builtin_mul_overflow((size_t)wanted, size, &bytes), fresh = bytes >= APART || silt_borrowed(data);
    if (fits)
        grown = fresh ? apart(bytes) : realloc(data, bytes ? bytes : 1);
    if (!grown)
        memory_exhausted((size_t)wanted, size);
    if (!fresh)
        memset((char *)grown + old, 0, bytes - old);
    else {
        if (old)
            memcpy(grown, data, old);
        silt_return(data);
    }
    *capacity = (int)wanted;
    return grown;
}

char *silt_text(const char *format, ...) {
    va_list list, again;
    va_start(list, format);
    va_copy(again, list);
    int length = vsnprintf(NULL, 0, format, list);
    va_end(list);
    size_t size = length < 0 ? 1 : (size_t)length + 1;
    char *text = silt_alloc(size, 1);
    if (length >= 0)
        vsnprintf(text, size, format, again);
    va_end(again);
    return text;
}

double silt_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static _Thread_local struct {
    double seconds[CLOCK_COUNT], since;
    double other; // s, of processes that worked for this one while it waited
    silt_clock now;
    bool cpu;
} clocks = {.now = CLOCK_rest};

double silt_clock_now(void) {
    if (!clocks.cpu)
        return silt_seconds();
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return clocks.other + (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool silt_clock_else(double seconds) {
    if (clocks.cpu)
        clocks.other += seconds;
    return clocks.cpu;
}

void silt_clock_cpu(bool cpu) {
    clocks.cpu = cpu;
    silt_clock_reset();
}

silt_clock silt_clock_to(silt_clock clock) {
    const double now = silt_clock_now();
    const silt_clock before = clocks.now;
    clocks.seconds[before] += now - clocks.since;
    clocks.since = now;
    clocks.now = clock;
    return before;
}

void silt_clock_reset(void) {
    clocks.now = CLOCK_rest;
    clocks.since = silt_clock_now();
    memset(clocks.seconds, 0, sizeof clocks.seconds);
}

void silt_clock_book(silt_clock clock, double seconds) {
    clocks.seconds[clock] += seconds;
    clocks.seconds[clocks.now] -= seconds;
}

void silt_clock_read(double seconds[CLOCK_COUNT]) {
    silt_clock_to(clocks.now);
    memcpy(seconds, clocks.seconds, sizeof clocks.seconds);
}

uint64_t silt_hash(uint64_t seed, const void *data, size_t size) {
    // FNV-1a, 64 bits
    uint64_t hash = seed ? seed : 0xcbf29ce484222325u;
    const unsigned char *byte = data;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ byte[i]) * 0x100000001b3u;
    return hash;
}

uint64_t silt_random(uint64_t *state) {
    // splitmix64
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double silt_uniform(uint64_t *state) {
    return (double)(silt_random(state) >> 11) * 0x1p-53;
}

void silt_sort_few(int n, int *number) {
    for (int a = 1; a < n; a++) {
        const int key = number[a];
        int b = a - 1;
        for (; b >= 0 && number[b] > key; b--)
            number[b + 1] = number[b];
        number[b + 1] = key;
    }
}
