/* Names that the shared library shows to the outside. */
#ifndef CONTACTLIB_EXPORT_H
#define CONTACTLIB_EXPORT_H

#if defined(_WIN32)
#define CONTACTLIB_API __declspec(dllexport)
#else
#define CONTACTLIB_API __attribute__((visibility("default")))
#endif

#endif
