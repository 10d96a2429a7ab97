/* Files of the FMU's resources folder, addressed by the URI that the tool hands over. */
#ifndef RESOURCE_H
#define RESOURCE_H

#include <stddef.h>

/* Read resources/<name> whole into malloc'ed memory. Returns NULL and sets *bytes and *size, or
 * returns what went wrong, possibly written to message. */
const char *resource_read(const char *resource_uri, const char *name, void **bytes, size_t *size,
                          char *message, size_t message_size);

#endif
