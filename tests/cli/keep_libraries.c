// Preloaded into a program that is checked for leaks: keeps libraries loaded. Otherwise LeakSanitizer reports the memory of a graphics driver as leaked after
// the driver was unloaded, and a suppression cannot name a library that is gone.
int dlclose(void *handle);

int dlclose(void *handle)
{
    (void)handle;
    return 0;
}
