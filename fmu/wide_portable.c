/* Version for any processor of the platform. */
#define WIDE_SUFFIX portable
#include "wide_functions.h"
