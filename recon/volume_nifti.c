typedef int placeholder_volume_nifti;
