/* Files in the FMU's resources folder, whose URI the tool gives. */
#ifndef FILE_IO_H
#define FILE_IO_H

#include <stddef.h>

/* Read the whole file resources/<name> into malloc'ed memory. Some tools give the FMU's folder in
 * place of its resources folder. Returns NULL and sets *bytes and *size, or returns an error
 * message, possibly written to message. */
const char *resource_read(const char *resource_uri, const char *name, void **bytes, size_t *size,
                          char *message, size_t message_size);

#endif
