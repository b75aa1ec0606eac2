// Preloaded into a program that is looked at for leaks: libraries stay once they are loaded. LeakSanitizer takes what a graphics driver keeps for leaked
// once the driver is unloaded, and nothing that it could be excused by has a name then.
int dlclose(void *handle);

int dlclose(void *handle)
{
    (void)handle;
    return 0;
}
