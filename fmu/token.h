/* What ties a modelDescription.xml to this library: a digest of the sources, set by the build. */
#ifndef TOKEN_H
#define TOKEN_H

#include "export.h"

#ifndef CONTACTLIB_TOKEN
#include "token_value.h" /* beside the sources inside an FMU; build_hook.py sets it by a flag */
#endif

CONTACTLIB_API const char *contactlib_token(void);

#endif
