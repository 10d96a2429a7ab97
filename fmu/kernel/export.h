/* Marks the functions that the shared library exports. */
#ifndef CONTACTLIB_EXPORT_H
#define CONTACTLIB_EXPORT_H

#if defined(_WIN32)
#define CONTACTLIB_API __declspec(dllexport)
#else
#define CONTACTLIB_API __attribute__((visibility("default")))
#endif

/* An assertion at compile time; C99 has no static_assert. */
#define ASSERT_LAYOUT(name, holds) typedef char name[(holds) ? 1 : -1]

#endif
