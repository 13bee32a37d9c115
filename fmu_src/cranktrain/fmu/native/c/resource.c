#ifndef _WIN32
#define _POSIX_C_SOURCE 200809L
#define _FILE_OFFSET_BITS 64
#endif
#include "resource.h"

#include <stdint.h>
#include <string.h>

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#else
#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

static int digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/* True if a text begins with ``begin`` (small letters), in any case. */
static bool begins(const char *text, const char *begin) {
    for (; *begin != '\0'; ++text, ++begin) {
        if ((*text >= 'A' && *text <= 'Z' ? *text - 'A' + 'a' : *text) != *begin) return false;
    }
    return true;
}

/* Path of a location, which is a plain path or a file URI; some hosts do not percent-encode the URI. */
static bool path_of(const char *location, char *path) {
    const bool uri = begins(location, "file:");
    if (uri) {
        location += strlen("file:");
        if (begins(location, "//localhost/")) location += strlen("//localhost");
#ifdef _WIN32
        /* file:///C:/x and file://C:/x are paths; file://server/x is on another machine: \\server\x. */
        const char *drive = location;
        while (*drive == '/') ++drive;
        if (drive[0] != '\0' && drive[1] == ':') location = drive;
#else
        if (begins(location, "//") && location[2] != '/') return false; /* the folder is on another machine */
        while (location[0] == '/' && location[1] == '/') ++location;
#endif
    } else if (strstr(location, "://") != NULL) {
        return false;
    }
    while (*location != '\0') {
        const int high = uri && location[0] == '%' ? digit(location[1]) : -1;
        const int low = high >= 0 ? digit(location[2]) : -1;
        if (low < 0) {
            *path++ = *location++;
            continue;
        }
        if (high == 0 && low == 0) return false;
        *path++ = (char)(16 * high + low);
        location += 3;
    }
    *path = '\0';
    return true;
}

#ifdef _WIN32

static bool map_file(const struct ct_host *host, const char *path, struct ct_map *map) {
    const int n = MultiByteToWideChar(CP_UTF8, 0, path, -1, NULL, 0);
    wchar_t *wide = n > 0 ? ct_allocate(host, (size_t)n * sizeof *wide) : NULL;
    if (wide == NULL) return ct_refuse(host, "%s: not a path, or no memory", path) == CT_OK;
    MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, n);
    HANDLE file = CreateFileW(wide, GENERIC_READ, FILE_SHARE_READ, NULL, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, NULL);
    ct_release(host, wide);
    if (file == INVALID_HANDLE_VALUE) {
        const unsigned long error = GetLastError();
        const bool missing = error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND;
        ct_refuse(host, "%s %s (error %lu); unpack the FMU again", path, missing ? "is missing" : "cannot be read", error);
        return false;
    }
    LARGE_INTEGER size = {.QuadPart = 0};
    HANDLE mapping = NULL;
    if (GetFileSizeEx(file, &size) && size.QuadPart > 0) {
        mapping = CreateFileMappingW(file, NULL, PAGE_READONLY, 0, 0, NULL);
    }
    map->size = (size_t)size.QuadPart;
    map->bytes = mapping == NULL ? NULL : MapViewOfFile(mapping, FILE_MAP_READ, 0, 0, 0);
    if (mapping != NULL) CloseHandle(mapping);
    CloseHandle(file);
    if (map->bytes == NULL) ct_refuse(host, "%s is empty or cannot be mapped; unpack the FMU again", path);
    return map->bytes != NULL;
}

void ct_unmap(struct ct_map *map) {
    if (map->bytes != NULL) UnmapViewOfFile(map->bytes);
    map->bytes = NULL;
}

#else

static bool map_file(const struct ct_host *host, const char *path, struct ct_map *map) {
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    struct stat about;
    if (file < 0) {
        const int error = errno;
        const bool missing = error == ENOENT || error == ENOTDIR;
        ct_refuse(host, "%s %s (error %d); unpack the FMU again", path, missing ? "is missing" : "cannot be read", error);
        return false;
    }
    if (fstat(file, &about) == 0 && S_ISREG(about.st_mode) && about.st_size > 0) {
        map->size = (size_t)about.st_size;
        void *bytes = mmap(NULL, map->size, PROT_READ, MAP_PRIVATE, file, 0);
        map->bytes = bytes == MAP_FAILED ? NULL : bytes;
    }
    close(file);
    if (map->bytes == NULL) ct_refuse(host, "%s is empty or cannot be mapped; unpack the FMU again", path);
    return map->bytes != NULL;
}

void ct_unmap(struct ct_map *map) {
    if (map->bytes != NULL) munmap((void *)(uintptr_t)map->bytes, map->size);
    map->bytes = NULL;
}

#endif

bool ct_map_resource(const struct ct_host *host, const char *location, const char *name, struct ct_map *map) {
    *map = (struct ct_map){NULL, 0};
    if (location == NULL || location[0] == '\0') {
        ct_refuse(host, "no fmuResourceLocation; the host must tell where the FMU's resources are");
        return false;
    }
    char *path = ct_allocate(host, strlen(location) + strlen(name) + 2);
    if (path == NULL) return ct_refuse(host, "no memory for a path") == CT_OK;
    bool known = path_of(location, path);
    if (known) {
        if (path[0] != '\0' && path[strlen(path) - 1] != '/') strcat(path, "/");
        strcat(path, name);
        known = map_file(host, path, map);
    } else {
        ct_refuse(host, "fmuResourceLocation '%s' is no file of this machine; it must be like file:///path/resources",
                  location);
    }
    ct_release(host, path);
    return known;
}
