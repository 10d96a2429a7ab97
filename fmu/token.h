/* What ties a modelDescription.xml to this library: a digest of the sources, set by the build. */
#ifndef TOKEN_H
#define TOKEN_H

#include "export.h"

#ifndef CONTACTLIB_TOKEN
#error "define CONTACTLIB_TOKEN as a string, as build_hook.py does"
#endif

CONTACTLIB_API const char *contactlib_token(void);

#endif
