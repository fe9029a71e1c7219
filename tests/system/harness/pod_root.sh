# The root of a container: this machine's programs and libraries, read-only, in place of an image's.
set -e
root=$1 program=$2
mount --make-rprivate /
ip link set lo up
mkdir "$root"
mount -t tmpfs -o mode=755 pod "$root"
cd "$root"
mkdir usr proc dev tmp image etc
mount --rbind /usr usr
mount -o remount,bind,ro usr
for folder in bin sbin lib lib32 lib64 libx32; do
    if [ -L /$folder ]; then cp -P /$folder $folder; elif [ -d /$folder ]; then mkdir $folder; mount --bind /$folder $folder; fi
done
cp /etc/ld.so.cache etc
mkdir etc/ssl && mount --bind /etc/ssl etc/ssl
mount --rbind /proc proc
mount --rbind /dev dev
mount -t tmpfs -o mode=1777 pod tmp
touch image/palmares && mount --bind "$program" image/palmares
cd /
