/* The token that ties a modelDescription.xml to this library: a digest of the sources. */
#ifndef TOKEN_H
#define TOKEN_H

#include "export.h"

#ifndef CONTACTLIB_TOKEN
#include "token_value.h" /* only inside an FMU; build_hook.py defines CONTACTLIB_TOKEN by a flag */
#endif

CONTACTLIB_API const char *contactlib_token(void);

#endif
