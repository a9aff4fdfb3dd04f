/* What hosts of every version of FMI share: a library loaded at run time, tables of numbers. */
#ifndef COMMON_H
#define COMMON_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
typedef HMODULE Library;
static Library library_open(const char *path) { return LoadLibraryA(path); }
static void *library_find(Library library, const char *name) { return (void *)GetProcAddress(library, name); }
static void library_close(Library library) { FreeLibrary(library); }
#else
#include <dlfcn.h>
typedef void *Library;
static Library library_open(const char *path) {
    Library library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) fprintf(stderr, "%s\n", dlerror());
    return library;
}
static void *library_find(Library library, const char *name) { return dlsym(library, name); }
static void library_close(Library library) { dlclose(library); }
#endif

#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            exit(1); \
        } \
    } while (0)

/* ---------------------------------------------------------------------------------------------------------- tables */

enum { MOST_COLUMNS = 64 };

typedef struct {
    size_t rows, columns;
    double *values; /* row by row; the first column is time */
} Table;

/* A CSV file: one line of names, then numbers. */
static Table table_read(const char *path) {
    static char line[1 << 16];
    Table table = {0, 0, NULL};
    FILE *file = fopen(path, "r");
    CHECK(file && fgets(line, sizeof line, file));
    while (fgets(line, sizeof line, file)) {
        char *at = line, *end;
        size_t columns = 0;
        table.values = realloc(table.values, (table.rows + 1) * MOST_COLUMNS * sizeof(double));
        CHECK(table.values);
        for (; columns < MOST_COLUMNS; columns++) {
            table.values[table.rows * MOST_COLUMNS + columns] = strtod(at, &end);
            if (end == at) break;
            at = *end == ',' ? end + 1 : end;
        }
        CHECK(table.rows == 0 || columns == table.columns);
        table.columns = columns;
        table.rows++;
    }
    fclose(file);
    return table;
}

static const double *table_row(const Table *table, size_t row) { return table->values + row * MOST_COLUMNS; }

/* Value references from a text such as "0,1,2". */
static size_t references_read(const char *text, unsigned references[MOST_COLUMNS]) {
    size_t count = 0;
    while (*text && count < MOST_COLUMNS) {
        char *end;
        references[count++] = (unsigned)strtoul(text, &end, 10);
        text = *end == ',' ? end + 1 : end;
    }
    return count;
}

#endif
