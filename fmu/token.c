#include "token.h"

const char *contactlib_token(void) { return CONTACTLIB_TOKEN; }
