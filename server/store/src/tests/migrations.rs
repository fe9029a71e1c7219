//! The texts of the migrations.

use crate::database::migrator;
use crate::location::Dialect;

/// Version, dialect and SHA-384 of each text. A database keeps this checksum of every migration that it has had, and a program whose
/// text differs cannot open it: a line here never changes.
const LANDED: &str = "\
1 Both 733f6cf311bacc6557521906beefa2349ed10a3a070ac63521504268ae8bb3be0e492450c8685f36e2d52023ce889604
2 Both 1f39a3f71e12d0f770fc11ceb8344954e2a2373d8014dd6d97b1d6f32055569c14d60994fb912517062914c90d3f4b77
3 Both b91030792181ec6c4c08d4cda10ce99d24f0a1d95730d611858d5b24d682dd18fa569c10f480ba170084a791314eb189
4 Both 1464bd4cb9cc0c9c249168433728f62f70f2a4b5801bd3f3d3eba5b65189179d8cc0cdda471888d94a24409b770203ee
5 Both c38630226ec2d494ad42627d7c1a058fca29474d5f8ed31ddba515d160273d2f21f3ac04873c7cd4f43737c9a76268ce
6 Sqlite 7b3d8ec64e5e53bb634b457fcbc7b205d96805179fa04dec210b7fbd515e4e056f6ddb9eb02760f169310e6abb026550
6 Postgres 145d2a1d48cfcbc7f6c6f989d936f916ab70924fc9699446ea52825c8dd8fc05daf4b1dcae3fc1ed6f1afc4fc134700b
7 Both 37b47f4ed43ae89589fdfa4be45293e1abbb508abe1d2a6a4d35da83542e63639d6a458538b3aca6b460bd7ccd029a2c
8 Sqlite 26e5c141ac5f90b932ffc7fd0dba5b4730e61a3e9deb0217fedbc26ad03903f7b0ea54e3e462bf563ff247a1b93b5f57
8 Postgres 55429533486bd43b85da610959a16f9fdd60fea6b29897d16fc9e04b55fce75a36036d002629ea4d31757348f382739b
9 Both e63737ff4173ab42798948fe2c13f0594ac297507d193b1c4fb5ec7be335b3521873cf02faff59a243e26c9f776f57b1
10 Both f7cf9a71d6b2a017645be16c2620c346abc30c64b39cfded5e8662e94ef894c9636e77a3b50549ced52a05999a607e55
11 Both 2253008b643945433d000a703c407d82c5598a607c6c354a3c72049b156956019462c470fc2f9709e321587781c38924
12 Both 6a1c5965cb9895d4a0035b6582f005fd5dcf14d70a5e0a0ef6772db0976ce3c4d9206d2b90b0c6f932da1b1003fdd9b0
13 Both 7e0de6fa8ebf8bcdcb8be404be3ddda3d2b3a22da3f36400fb3efb489ee628ce32187a22cb676d47eb4ca2367087202e
14 Sqlite fec3a0e26ed388929c082cba1cf72ed5206c5274c780dba6ba771eafda09a87825d2413aeb908927c2be96848b31a1ae
14 Postgres 56e2c99e51ac02afe6ecde4ad98205c08c6231a5dbfc7d93526394d8990d29cecb2e860b55d117f66178400832aa2287
15 Both b58a638ed53bfc12f7efe3c6fe8c9bb683ffed7d3ac53f0c8a562fde3c640d01fa440ae38bf40e996ffa1371fda83771
16 Both 76256f83d80307116ce4c062a5a4f8353432b25d47f8770da8fec76c63457f8ae771ab2343c17f01ef5406ad98eb5e95
";

#[test]
fn a_landed_migration_never_changes() {
    for dialect in [Dialect::Sqlite, Dialect::Postgres] {
        let (migrator, of_dialect) = (migrator(dialect), format!(" {dialect:?} "));
        let landed: Vec<String> = LANDED
            .lines()
            .map(|line| line.replace(" Both ", &of_dialect))
            .filter(|line| line.contains(&of_dialect))
            .collect();
        let made = migrator.iter().map(|m| format!("{}{of_dialect}{}", m.version, hex::encode(&*m.checksum)));
        assert_eq!(made.collect::<Vec<_>>(), landed);
    }
}
