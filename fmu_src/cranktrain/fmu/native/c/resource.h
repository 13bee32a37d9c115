/* Files of the resources folder, mapped read-only. */
#ifndef CT_RESOURCE_H
#define CT_RESOURCE_H

#include "host.h"

struct ct_map {
    const unsigned char *bytes;
    size_t size;
};

/* Map a file of the resources folder. Return false, with the reason in the log, if there is no such file. */
bool ct_map_resource(const struct ct_host *host, const char *location, const char *name, struct ct_map *map);
void ct_unmap(struct ct_map *map);

#endif
