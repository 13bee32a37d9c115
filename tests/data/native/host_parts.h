/* Parts of both plain hosts: a library's functions, threads, numbers at random. */
#ifndef HOST_PARTS_H
#define HOST_PARTS_H

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#include <pthread.h>
#endif
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define dlopen(path, flags) ((void *)LoadLibraryA(path))
#define dlclose(library) FreeLibrary(library)
#define dlerror() "the library cannot be loaded"
#define BEGIN DWORD WINAPI
typedef HANDLE thread;
static void *dlsym(void *library, const char *name) { return (void *)(uintptr_t)GetProcAddress(library, name); }
static int begin(thread *made, LPTHREAD_START_ROUTINE work, void *given) {
    *made = CreateThread(NULL, 0, work, given, 0, NULL);
    return *made == NULL;
}
static void end(thread made) { WaitForSingleObject(made, INFINITE); }
#else
#define BEGIN void *
typedef pthread_t thread;
static int begin(thread *made, void *(*work)(void *), void *given) { return pthread_create(made, NULL, work, given); }
static void end(thread made) { pthread_join(made, NULL); }
#endif
#define MEMBER(name) __typeof__(&name) name;
#define LOAD(name) *(void **)&f.name = loaded(library, #name);

static void fail(const char *what) {
    fprintf(stderr, "host: %s\n", what);
    exit(1);
}

static void *loaded(void *library, const char *name) {
    void *function = dlsym(library, name);
    if (function == NULL) fail(name);
    return function;
}

static uint64_t draw(uint64_t *seed, uint64_t n) {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return *seed % n;
}

static double number(uint64_t *seed) {
    static const double ODD[] = {0.0, -0.0, 1.0, -1.0, 1e-300, 1e-12, 1e300, NAN, INFINITY, -INFINITY, 100.0, 101325.0};
    return ODD[draw(seed, sizeof ODD / sizeof ODD[0])];
}

#endif
